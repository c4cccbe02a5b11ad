!> Where the machine shakes the ground: the forces of every support, of the foundation, of the guides, and all together.
module gestell_task_forces_reactions
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_mounting, only: stiffness_matrix
  use gestell_model_frame_quantity, only: find_quantity
  use gestell_model_frame_rows, only: guide_forces, probe_type, quantity_type, velocities
  use gestell_study_vibration_statistics, only: history_of, statistics_type, take_least, take_statistics
  use gestell_study_vibration, only: check_rows, vibration_type
  implicit none (type, external)
  private

  public :: find_reactions, static_force

  !> What is told of a reaction: the force on the ground along x and y, its size (N), and its moment about F at rest (N m); a
  !> support exerts none but that of its force, and has no moment of its own.
  integer, parameter, public :: along_x = 1, along_y = 2, whole_force = 3, moment = 4, force_parts = 4

  type, public :: reaction_type
    !> The support's number, "foundation", "guide", "total"; where it is in the frame's system (m).
    character(len=12) :: name = ""
    real(dp) :: position(2) = 0
    !> Whether it has a moment of its own.
    logical :: turns = .true.
    type(statistics_type), allocatable :: statistics(:)
    !> At the times of the vibration's history, shape (points + 1, force_parts).
    real(dp), allocatable :: history(:, :)
    !> With weights: the static force on the ground (N), and the least over the turn of the whole force along gravity with a bound
    !> on its error: a support that carries something lifts off where its least compression is negative.
    logical :: weighed = .false., carrying = .false.
    real(dp) :: static(2) = 0, least_compression = 0, least_error = 0
  end type reaction_type

contains

  !> Supports in the frame's order, then foundation and guide where they carry anything, then the total. Errors: as of the frame's
  !> `check`; `vibration` does not hold the rows of the motion that they need.
  subroutine find_reactions(frame, vibration, reactions, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(reaction_type), allocatable, intent(out) :: reactions(:)
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type) :: parts(force_parts), guide(force_parts)
    logical :: founded, guided
    integer :: i, n

    call frame%check(error)
    if (.not. allocated(error)) call check_rows(vibration, merge(guide_forces, velocities, size(frame%free) < 3), error)
    if (allocated(error)) return
    n = size(frame%supports)
    call force_of(frame, "foundation.", parts)
    founded = carries(parts(along_x)) .or. carries(parts(along_y)) .or. carries(parts(moment))
    guided = size(frame%free) < 3
    allocate(reactions(n + count([founded, guided]) + 1))
    if (founded) call take_reaction(frame, vibration, "foundation", parts, reactions(n + 1), error)
    if (allocated(error)) return
    do i = 1, n
      call force_of(frame, "support(" // text(i) // ").", parts)
      reactions(i)%position = frame%supports(i)%position
      reactions(i)%turns = .false.
      call take_reaction(frame, vibration, text(i), parts, reactions(i), error)
      if (allocated(error)) return
    end do
    call force_of(frame, "guide.", guide)
    if (guided) call take_reaction(frame, vibration, "guide", guide, reactions(size(reactions) - 1), error)
    if (allocated(error)) return
    call force_of(frame, "", parts)
    do i = along_x, moment
      if (i /= whole_force) parts(i)%weights = parts(i)%weights + guide(i)%weights
    end do
    call take_reaction(frame, vibration, "total", parts, reactions(size(reactions)), error)
  end subroutine find_reactions

  !> What the weights do to `reaction`, whose forces are `parts`.
  subroutine weigh(frame, vibration, parts, reaction, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: parts(force_parts)
    type(reaction_type), intent(inout) :: reaction
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: roundings = 1.0e-12_dp
    type(quantity_type) :: along
    real(dp) :: down(2), least

    down = [real(frame%weights%gravity, dp), aimag(frame%weights%gravity)] / abs(frame%weights%gravity)
    along = parts(along_x)
    along%weights = down(1) * parts(along_x)%weights + down(2) * parts(along_y)%weights
    if (allocated(along%rounding)) along%rounding = abs(down(1)) * parts(along_x)%rounding &
      & + abs(down(2)) * parts(along_y)%rounding
    call take_least(vibration, along, least, reaction%least_error, error)
    if (allocated(error)) return
    reaction%weighed = .true.
    reaction%static = static_force(frame, trim(reaction%name))
    reaction%least_compression = dot_product(down, reaction%static) + least
    ! Beside a guide that carries the frame a support bears nothing, and nothing can lift it off.
    reaction%carrying = .not. reaction%turns .and. dot_product(down, reaction%static) > roundings * norm2(frame%weights%load(:2))
  end subroutine weigh

  !> The static force (N) on the ground by the weights, of the reaction of that name.
  pure function static_force(frame, name) result(force)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    real(dp) :: force(2)
    integer :: i

    associate (weights => frame%weights)
      select case (name)
      case ("total")
        force = weights%load(:2)
      case ("guide")
        force = 0
        do i = 1, 2
          if (all(frame%free /= i)) force(i) = weights%load(i) - dot_product(frame%stiffness(i, :), weights%sag)
        end do
      case ("foundation")
        force = weights%static_forces(frame%stiffness - stiffness_matrix(frame%supports))
      case default
        force = 0
        do i = 1, size(frame%supports)
          if (name == text(i)) force = weights%static_forces(stiffness_matrix([frame%supports(i)]))
        end do
      end select
    end associate
  end function static_force

  !> The forces of `reaction`, named with its dot. What it does not have remains unallocated.
  subroutine force_of(frame, reaction, parts)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: reaction
    type(quantity_type), intent(out) :: parts(force_parts)
    character(len=*), parameter :: names(force_parts) = [character(len=2) :: "fx", "fy", "f", "m"]
    type(probe_type) :: none(0)
    type(error_type), allocatable :: error
    integer :: i

    do i = 1, force_parts
      call find_quantity(frame, none, reaction // trim(names(i)), parts(i), error)
    end do
  end subroutine force_of

  pure logical function carries(quantity)
    type(quantity_type), intent(in) :: quantity

    carries = any(abs(quantity%weights) > 0)
  end function carries

  !> What is told of a reaction that is called `name` and whose forces are `parts`.
  subroutine take_reaction(frame, vibration, name, parts, reaction, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: name
    type(quantity_type), intent(in) :: parts(force_parts)
    type(reaction_type), intent(inout) :: reaction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: history(:)
    integer :: i

    reaction%name = name
    allocate(reaction%statistics(force_parts))
    allocate(reaction%history(size(vibration%motion_history, 2), force_parts), source=0.0_dp)
    do i = 1, force_parts
      if (.not. allocated(parts(i)%weights)) cycle
      call take_statistics(vibration, parts(i), reaction%statistics(i), error)
      if (.not. allocated(error)) call history_of(vibration, parts(i), history, error)
      if (allocated(error)) return
      reaction%history(:, i) = history
    end do
    if (frame%weights%act) call weigh(frame, vibration, parts, reaction, error)
  end subroutine take_reaction

end module gestell_task_forces_reactions
