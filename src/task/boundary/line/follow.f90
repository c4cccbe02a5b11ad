!> Follows all multipliers along a line from node to node, and inserts nodes where the multipliers change too much.
module gestell_task_boundary_line_follow
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: impossible, operator(==)
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_line_exponents, only: connect, node_type, solve_node, stretch_type
  use gestell_task_boundary_line, only: line_type
  use gestell_task_common_executor, only: distribute_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: follow_multipliers

  !> The multipliers along a line, in intervals between nodes. Parts of the line without systems have no intervals.
  type, public :: chain_type
    integer :: count = 0
    !> Successive intervals between nodes. Only the first `count` elements are used.
    type(stretch_type), allocatable :: list(:)
    !> Both ends of each part of the line in which the multipliers are unknown, shape (2, number of parts). In such a part a
    !> system could not be solved, or systems with different numbers of states meet.
    real(dp), allocatable :: holes(:, :)
  end type chain_type

  !> Parallel work: each piece solves one node.
  type, extends(work_type) :: nodes_type
    type(line_type), pointer :: line => null()
    real(dp), allocatable :: t(:)
    real(dp) :: ends(2) = 0
    type(node_type), allocatable :: nodes(:)
  contains
    procedure :: compute, exchange
  end type nodes_type

  !> An interval is not divided if it is shorter than `shortest`, relative to the line. If one of its ends has no system, the limit
  !> is `shortest_at_gap` instead.
  real(dp), parameter :: shortest = 1.0e-7_dp, shortest_at_gap = 1.0e-4_dp
  !> Intervals are no longer divided if there are more nodes than this.
  integer, parameter :: most = 4000
  !> States of an interval. `open`: the interval must be divided. `done`: it is accurate enough or cannot be divided. `empty`: it
  !> has no systems.
  integer, parameter :: open = 0, done = 1, empty = 2

contains

  !> Follows the multipliers from the first to the last of the ascending positions `t`. There is a node at every position in `t`.
  !> Further nodes are inserted where the multipliers deviate from the prediction of their slopes: in each round all inaccurate
  !> intervals are halved together. If the maximum number of nodes is reached, inaccurate curves therefore remain only in the
  !> shortest intervals. Fails if the parameters are invalid.
  subroutine follow_multipliers(line, t, chain, error)
    type(line_type), intent(in), target :: line
    real(dp), intent(in) :: t(:)
    type(chain_type), intent(out) :: chain
    type(error_type), allocatable, intent(out) :: error
    type(nodes_type) :: work
    type(node_type), allocatable :: nodes(:), refined(:)
    integer, allocatable :: state(:), refined_state(:)
    integer :: i, n

    allocate(chain%holes(2, 0))
    work%line => line
    work%ends = t([1, size(t)])
    associate (span => t(size(t)) - t(1))
      call solve_nodes(work, t, error)
      if (allocated(error)) return
      call move_alloc(work%nodes, nodes)
      allocate(state(size(t) - 1), source=open)
      do
        do i = 1, size(state)
          if (state(i) == open) state(i) = state_of(nodes(i), nodes(i + 1), span)
        end do
        if (size(nodes) > most .or. .not. any(state == open)) exit
        call solve_nodes(work, pack([((nodes(i)%at%t + nodes(i + 1)%at%t) / 2, i = 1, size(state))], state == open), error)
        if (allocated(error)) return
        n = size(work%nodes)
        allocate(refined(size(nodes) + n), refined_state(size(state) + n))
        n = 0
        do i = 1, size(state)
          n = n + 1
          refined(n) = nodes(i)
          refined_state(n) = state(i)
          if (state(i) /= open) cycle
          n = n + 1
          refined_state(n) = open
          refined(n) = work%nodes(n - i)
        end do
        refined(n + 1) = nodes(size(nodes))
        call move_alloc(refined, nodes)
        call move_alloc(refined_state, state)
      end do
    end associate
    allocate(chain%list(size(state)))
    do i = 1, size(state)
      if (have_equal_size(nodes(i), nodes(i + 1))) then
        chain%count = chain%count + 1
        call connect(nodes(i), nodes(i + 1), chain%list(chain%count))
      else if (.not. any([nodes(i)%at%verdict, nodes(i + 1)%at%verdict] == impossible)) then
        n = size(chain%holes, 2)
        if (any(chain%holes(2, :) >= nodes(i)%at%t)) then
          chain%holes(2, n) = nodes(i + 1)%at%t                      ! adjacent holes are merged
        else
          chain%holes = reshape([chain%holes, nodes(i)%at%t, nodes(i + 1)%at%t], [2, n + 1])
        end if
      end if
    end do
  end subroutine follow_multipliers

  !> Solves the nodes at the positions `t`. Fails if the parameters are invalid.
  subroutine solve_nodes(work, t, error)
    type(nodes_type), intent(inout) :: work
    real(dp), intent(in) :: t(:)
    type(error_type), allocatable, intent(out) :: error

    work%t = t
    if (allocated(work%nodes)) deallocate(work%nodes)
    allocate(work%nodes(size(t)))
    call distribute_over(work, size(t), error, work%line%executor)
  end subroutine solve_nodes

  recursive subroutine compute(self, k, error)
    class(nodes_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call solve_node(self%line, self%t(k), self%ends, self%nodes(k), error)
  end subroutine compute

  subroutine exchange(self, k, record)
    class(nodes_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%nodes(k)%at%exchange(record)
    if (.not. self%nodes(k)%at%missing()) call record%pass(self%nodes(k)%slope)
  end subroutine exchange

  !> State of the interval between two nodes: `open` if it must be divided, `empty` if it has no systems, otherwise `done`.
  pure integer function state_of(l, r, span) result(state)
    type(node_type), intent(in) :: l, r
    real(dp), intent(in) :: span
    type(stretch_type) :: stretch

    state = open
    associate (h => r%at%t - l%at%t)
      if (have_equal_size(l, r)) then
        call connect(l, r, stretch)
        if (h < shortest * span .or. .not. stretch%rough) state = done
      else if ((l%at%missing() .and. r%at%missing()) .or. h < shortest_at_gap * span) then
        state = empty
      end if
    end associate
  end function state_of

  !> True if both nodes have systems, and these systems have the same number of states.
  pure logical function have_equal_size(l, r)
    type(node_type), intent(in) :: l, r

    have_equal_size = .not. (l%at%missing() .or. r%at%missing())
    if (have_equal_size) have_equal_size = size(l%at%z) == size(r%at%z)
  end function have_equal_size

end module gestell_task_boundary_line_follow
