!> Stores the points of a resonance curve in the order of their speeds.
module gestell_task_resonance_points
  use gestell_base_verdict, only: has_vibration
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: exchange_point

  !> A point of a resonance curve, which is either a point of the grid or was added by the refinement.
  type, public, extends(speed_point_type) :: curve_point_type
    !> True if the refinement added the point between points of the grid
    logical :: refined = .false.
  end type curve_point_type

  !> The points of a resonance curve.
  type, public :: curve_points_type
    !> Points in the order of the grid of speeds
    type(curve_point_type), allocatable :: points(:)
    !> True if the speed decreases from each point to the next
    logical :: descends = .false.
  contains
    procedure :: insert, select_new, levels, has_values, jumps
  end type curve_points_type

  !> Two speeds count as equal if their relative difference is smaller than this. Intervals whose relative width is smaller than
  !> four times this value are not divided
  real(dp), parameter, public :: same = 1.0e-10_dp
  !> Allowed deviation of the curve from a straight line between neighbouring points. The curve shows ln(peak) against the speed
  real(dp), parameter, public :: straight = 0.01_dp

contains

  !> Inserts points at new speeds. The new points must be given in the order of the grid.
  subroutine insert(self, points, refined)
    class(curve_points_type), intent(inout) :: self
    type(speed_point_type), intent(in) :: points(:)
    logical, intent(in) :: refined
    type(curve_point_type), allocatable :: all(:)
    logical :: new_first
    integer :: i, k, n

    n = size(self%points) + size(points)
    allocate(all(n))
    i = 1
    k = 1
    do n = 1, size(all)
      new_first = i > size(self%points)
      if (.not. new_first .and. k <= size(points)) new_first = (points(k)%speed < self%points(i)%speed) .neqv. self%descends
      if (new_first) then
        all(n)%speed_point_type = points(k)
        all(n)%refined = refined
        k = k + 1
      else
        all(n) = self%points(i)
        i = i + 1
      end if
    end do
    call move_alloc(all, self%points)
  end subroutine insert

  !> Selects those `speeds` that lie within the range and differ from every existing point by more than the relative distance
  !> `same`. The result `new` is in the order of the grid.
  subroutine select_new(self, speeds, same, new)
    class(curve_points_type), intent(in) :: self
    real(dp), intent(in) :: speeds(:), same
    real(dp), allocatable, intent(out) :: new(:)
    real(dp) :: sorted(size(speeds)), last, s
    integer :: i, k, n

    sorted = speeds(ascending(speeds))
    if (self%descends) sorted = sorted(size(sorted):1:-1)
    n = 0
    i = 1
    last = 0
    do k = 1, size(sorted)
      s = sorted(k)
      do while (i < size(self%points))
        if ((self%points(i + 1)%speed > s) .neqv. self%descends) exit
        i = i + 1
      end do
      if (i == size(self%points)) exit
      if (min(abs(s - self%points(i)%speed), abs(s - self%points(i + 1)%speed), abs(s - last)) <= same * abs(s)) cycle
      if ((s < self%points(1)%speed) .neqv. self%descends) cycle
      n = n + 1
      sorted(n) = s
      last = s
    end do
    allocate(new, source=sorted(:n))
  end subroutine select_new

  !> Computes `level` = ln(peak) of quantity number `q` at all points. `known`: true where a vibration exists and its peak exceeds
  !> the error bound of the peak. At all other points `level` is 0.
  subroutine levels(self, q, level, known)
    class(curve_points_type), intent(in) :: self
    integer, intent(in) :: q
    real(dp), allocatable, intent(out) :: level(:)
    logical, allocatable, intent(out) :: known(:)
    integer :: i

    known = self%has_values()
    allocate(level(size(known)), source=0.0_dp)
    do i = 1, size(known)
      if (.not. known(i)) cycle
      known(i) = self%points(i)%values(1, q) > max(self%points(i)%values(2, q), tiny(1.0_dp))
      if (known(i)) level(i) = log(self%points(i)%values(1, q))
    end do
  end subroutine levels

  !> True for each interval between neighbouring points, shape (points - 1), in which the exact frame jumps to another vibration.
  !> Such an interval is too short to be divided, but ln(peak) changes in it by more than `straight`.
  pure function jumps(self, level, known)
    class(curve_points_type), intent(in) :: self
    real(dp), intent(in) :: level(:)
    logical, intent(in) :: known(:)
    logical :: jumps(max(size(level) - 1, 0))
    integer :: i

    do i = 1, size(jumps)
      associate (a => self%points(i), b => self%points(i + 1))
        jumps(i) = known(i) .and. known(i + 1) .and. .not. (a%linear .or. b%linear) &
          & .and. abs(a%speed - b%speed) <= 4 * same * abs(a%speed) .and. abs(level(i + 1) - level(i)) > straight
      end associate
    end do
  end function jumps

  !> True for each point at which a vibration was found.
  pure function has_values(self) result(known)
    class(curve_points_type), intent(in) :: self
    logical :: known(size(self%points))

    known = has_vibration(self%points%state)
  end function has_values

  !> Writes a point to a record, or reads it from a record. Requested measures (`measured`) are not stored.
  subroutine exchange_point(point, record)
    type(speed_point_type), intent(inout) :: point
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)
    logical :: free

    call record%pass(point%speed)
    call record%pass(point%state)
    call record%pass(point%linear)
    call record%pass(point%from_fold)
    call record%pass(point%values)
    if (allocated(point%strongest)) words = int(point%strongest, int64)
    call record%pass_words(words)
    point%strongest = int(words)
    free = allocated(point%turns)
    call record%pass(free)
    if (free) then
      call record%pass(point%turns)
      call record%pass(point%growth)
      call record%pass(point%averaged_turns)
      call record%pass(point%crank)
      call record%pass(point%drive_turns)
    end if
    words = transfer(point%moved, [0_int64])
    call record%pass_words(words)
    point%moved = transfer(words, point%moved)
  end subroutine exchange_point

end module gestell_task_resonance_points
