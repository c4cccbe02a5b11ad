!> All multipliers followed along a line, from node to node as near as they want it.
module gestell_study_boundary_follow
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_boundary_exponents, only: connect, node_type, solve_node, stretch_type
  use gestell_study_boundary_line, only: line_type
  use gestell_study_family, only: family_type
  implicit none (type, external)
  private

  public :: follow_multipliers

  !> Stretches one after the other; where there are no systems there are none.
  type, public :: way_type
    integer :: count = 0
    type(stretch_type), allocatable :: list(:)
  contains
    procedure :: add
  end type way_type

  !> Parts of the whole: of a stretch that is not divided any more, and of one at whose other end there is no system.
  real(dp), parameter :: shortest = 1.0e-7_dp, beside_nothing = 1.0e-4_dp
  !> Stretches at the most.
  integer, parameter :: most = 20000

contains

  !> The stretches between the first and the last of `t`, ascending, with nodes at all of them and between them where the
  !> multipliers do not go on as their slopes say. Error: the parameters make no sense.
  subroutine follow_multipliers(family, line, t, way, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t(:)
    type(way_type), intent(out) :: way
    type(error_type), allocatable, intent(out) :: error
    type(node_type) :: l, r
    integer :: i

    associate (span => t(size(t)) - t(1))
      call solve_node(family, line, t(1), span, 1.0_dp, l, error)
      do i = 2, size(t)
        if (allocated(error)) return
        call solve_node(family, line, t(i), span, -1.0_dp, r, error)
        if (.not. allocated(error)) call follow(family, line, l, r, span, way, error)
        l = r
      end do
    end associate
  end subroutine follow_multipliers

  recursive subroutine follow(family, line, l, r, span, way, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    type(node_type), intent(in) :: l, r
    real(dp), intent(in) :: span
    type(way_type), intent(inout) :: way
    type(error_type), allocatable, intent(out) :: error
    type(stretch_type) :: stretch
    type(node_type) :: m
    logical :: smooth

    associate (h => r%at%t - l%at%t)
      if (.not. alike(l, r)) then
        if ((l%at%missing() .and. r%at%missing()) .or. h < beside_nothing * span) return
      else
        call connect(l, r, stretch)
        smooth = stretch%is_smooth()
        stretch%rough = .not. smooth
        if (smooth .or. h < shortest * span .or. way%count >= most) then
          call way%add(stretch)
          return
        end if
      end if
      call solve_node(family, line, l%at%t + h / 2, span, 1.0_dp, m, error)
    end associate
    if (.not. allocated(error)) call follow(family, line, l, m, span, way, error)
    if (.not. allocated(error)) call follow(family, line, m, r, span, way, error)
  end subroutine follow

  !> Whether both are systems of one size.
  pure logical function alike(l, r)
    type(node_type), intent(in) :: l, r

    alike = .not. (l%at%missing() .or. r%at%missing())
    if (alike) alike = size(l%at%z) == size(r%at%z)
  end function alike

  pure subroutine add(self, stretch)
    class(way_type), intent(inout) :: self
    type(stretch_type), intent(in) :: stretch
    type(stretch_type), allocatable :: longer(:)

    if (.not. allocated(self%list)) allocate(self%list(64))
    if (self%count == size(self%list)) then
      allocate(longer(2 * self%count))
      longer(:self%count) = self%list
      call move_alloc(longer, self%list)
    end if
    self%count = self%count + 1
    self%list(self%count) = stretch
  end subroutine add

end module gestell_study_boundary_follow
