!> Where the machine shakes the ground: the forces of every support, of the foundation, of the guides, and all together.
module gestell_study_ground
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: find_quantity, guide_forces, probe_type, quantity_type, velocities
  use gestell_study_statistics, only: history_of, statistics_type, take_statistics
  use gestell_study_vibration, only: check_rows, vibration_type
  implicit none (type, external)
  private

  public :: find_places

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
  end subroutine find_places

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

end module gestell_study_ground
