!> Where the machine shakes the ground: the forces of every support, of the foundation, of the guides, and all together.
module gestell_task_forces_ground
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_mounting, only: stiffness_matrix
  use gestell_model_frame_quantity, only: find_quantity, guide_forces, probe_type, quantity_type, velocities
  use gestell_study_vibration_statistics, only: history_of, statistics_type, take_least, take_statistics
  use gestell_study_vibration, only: check_rows, vibration_type
  implicit none (type, external)
  private

  public :: find_places, static_force

  !> What is told of a place: the force on the ground along x and y, its size (N), and the moment about F at rest (N m) that is
  !> exerted there; a support exerts none but that of its force, and has no moment of its own.
  integer, parameter, public :: along_x = 1, along_y = 2, whole_force = 3, moment = 4, force_parts = 4

  type, public :: place_type
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
  end type place_type

contains

  !> Supports in the frame's order, then foundation and guide where they carry anything, then the total. Errors: as of the frame's
  !> `check`; `vibration` does not hold the rows of the motion that they need.
  subroutine find_places(frame, vibration, places, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(place_type), allocatable, intent(out) :: places(:)
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
    allocate(places(n + count([founded, guided]) + 1))
    do i = 1, n
      call force_of(frame, "support(" // text(i) // ").", parts)
      places(i)%name = text(i)
      places(i)%position = frame%supports(i)%position
      places(i)%turns = .false.
      call take_place(vibration, parts, places(i), error)
      if (allocated(error)) return
    end do
    if (founded) then
      call force_of(frame, "foundation.", parts)
      places(n + 1)%name = "foundation"
      call take_place(vibration, parts, places(n + 1), error)
      if (allocated(error)) return
    end if
    call force_of(frame, "guide.", guide)
    if (guided) then
      places(size(places) - 1)%name = "guide"
      call take_place(vibration, guide, places(size(places) - 1), error)
      if (allocated(error)) return
    end if
    call force_of(frame, "", parts)
    do i = along_x, moment
      if (i /= whole_force) parts(i)%weights = parts(i)%weights + guide(i)%weights
    end do
    places(size(places))%name = "total"
    call take_place(vibration, parts, places(size(places)), error)
    if (allocated(error) .or. .not. frame%weights%act) return
    do i = 1, size(places)
      select case (trim(places(i)%name))
      case ("guide")
        parts = guide
      case ("total")
        call force_of(frame, "", parts)
        parts(along_x)%weights = parts(along_x)%weights + guide(along_x)%weights
        parts(along_y)%weights = parts(along_y)%weights + guide(along_y)%weights
      case ("foundation")
        call force_of(frame, "foundation.", parts)
      case default
        call force_of(frame, "support(" // trim(places(i)%name) // ").", parts)
      end select
      call weigh(frame, vibration, parts, places(i), error)
      if (allocated(error)) return
    end do
  end subroutine find_places

  !> What the weights do at `place`, whose forces are `parts`.
  subroutine weigh(frame, vibration, parts, place, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: parts(force_parts)
    type(place_type), intent(inout) :: place
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: roundings = 1.0e-12_dp
    type(quantity_type) :: along
    real(dp) :: down(2), least

    down = [real(frame%weights%gravity, dp), aimag(frame%weights%gravity)] / abs(frame%weights%gravity)
    along = parts(along_x)
    along%weights = down(1) * parts(along_x)%weights + down(2) * parts(along_y)%weights
    if (allocated(along%rounding)) along%rounding = abs(down(1)) * parts(along_x)%rounding &
      & + abs(down(2)) * parts(along_y)%rounding
    call take_least(vibration, along, least, place%least_error, error)
    if (allocated(error)) return
    place%weighed = .true.
    place%static = static_force(frame, trim(place%name))
    place%least_compression = dot_product(down, place%static) + least
    ! Beside a guide that carries the frame a support bears nothing, and nothing can lift it off.
    place%carrying = .not. place%turns .and. dot_product(down, place%static) > roundings * norm2(frame%weights%load(:2))
  end subroutine weigh

  !> The static force (N) by the weights on the ground of a place of that name.
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

  !> The forces that `place`, with its dot, exerts. What the place does not have remains unallocated.
  subroutine force_of(frame, place, parts)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: place
    type(quantity_type), intent(out) :: parts(force_parts)
    character(len=*), parameter :: names(force_parts) = [character(len=2) :: "fx", "fy", "f", "m"]
    type(probe_type) :: none(0)
    type(error_type), allocatable :: error
    integer :: i

    do i = 1, force_parts
      call find_quantity(frame, none, place // trim(names(i)), parts(i), error)
    end do
  end subroutine force_of

  pure logical function carries(quantity)
    type(quantity_type), intent(in) :: quantity

    carries = any(abs(quantity%weights) > 0)
  end function carries

  subroutine take_place(vibration, parts, place, error)
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: parts(force_parts)
    type(place_type), intent(inout) :: place
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: history(:)
    integer :: i

    allocate(place%statistics(force_parts))
    allocate(place%history(size(vibration%motion_history, 2), force_parts), source=0.0_dp)
    do i = 1, force_parts
      if (.not. allocated(parts(i)%weights)) cycle
      call take_statistics(vibration, parts(i), place%statistics(i), error)
      if (.not. allocated(error)) call history_of(vibration, parts(i), history, error)
      if (allocated(error)) return
      place%history(:, i) = history
    end do
  end subroutine take_place

end module gestell_task_forces_ground
