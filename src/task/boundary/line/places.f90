!> Finds positions on a line at which two multipliers meet. A tongue (region of instability) may exist at such a position.
module gestell_task_boundary_line_places
  use gestell_base_kinds, only: dp, pi
  use gestell_task_boundary_line_exponents, only: stretch_type
  use gestell_task_boundary_line_pair, only: pair_indices_type
  implicit none (type, external)
  private

  public :: meetings_on

  !> Position at which two multipliers meet.
  type, public :: place_type
    !> Number of the interval between nodes that contains the position.
    integer :: stretch = 0
    type(pair_indices_type) :: name
    !> `x`: relative position in the interval (0 to 1). `rate`: derivative of the phase difference (rad) with respect to the
    !> position t on the line.
    real(dp) :: x = 0, rate = 0
  end type place_type

  !> Positions in one interval at which multipliers meet.
  type, public :: places_type
    type(place_type), allocatable :: list(:)
  end type places_type

contains

  !> Positions at which two multipliers of interval `number` meet. Of two meetings that are complex conjugates, only one is
  !> included. Multipliers with the same sign of Krein's form stay on the unit circle where they meet: such meetings are omitted.
  pure function meetings_on(stretch, number) result(places)
    type(stretch_type), intent(in) :: stretch
    integer, intent(in) :: number
    type(place_type), allocatable :: places(:)
    integer, parameter :: samples = 16
    !> Two phases meet if their difference, apart from errors, is below `close` (rad). A meeting is omitted if the sine of the
    !> multipliers' argument is smaller than `below`, because the conjugate meeting is listed. Phases that differ by less than
    !> `locked` (rad) throughout the interval count as equal and do not meet. `safety`: factor on errors.
    real(dp), parameter :: close = 0.02_dp, below = -0.2_dp, locked = 1.0e-9_dp, safety = 4
    !> Pairs of multipliers rho whose ln |rho| is smaller are ignored: if they lost stability where they meet, the cubic curves
    !> would show it.
    real(dp), parameter :: strong_decay = -3
    complex(dp) :: z(size(stretch%mismatch), 0:samples)
    real(dp) :: phase_lead(0:samples), phase_difference(0:samples), near, x
    integer :: i, j, k, turns
    logical :: meets(samples)

    allocate(places(0))
    do k = 0, samples
      z(:, k) = stretch%at(real(k, dp) / samples)
    end do
    do i = 1, size(z, 1)
      do j = i + 1, size(z, 1)
        if (any(maxval(real(z([i, j], :)), dim=2) < strong_decay)) cycle
        if (abs(sum(stretch%krein([i, j], :))) > 3) cycle
        phase_lead = aimag(z(i, :) - z(j, :))
        near = close + safety * (abs(stretch%mismatch(i)) + abs(stretch%mismatch(j)))
        do turns = floor((minval(phase_lead) - near) / (2 * pi)), ceiling((maxval(phase_lead) + near) / (2 * pi))
          phase_difference = phase_lead - 2 * pi * turns
          if (minval(abs(phase_difference)) > near .and. all(phase_difference > 0 .eqv. phase_difference(0) > 0)) cycle
          if (maxval(abs(phase_difference)) <= locked) cycle
          ! Select the positions where the phases cross. If they do not cross, select the position where they are closest.
          meets = (phase_difference(1:) > 0) .neqv. (phase_difference(:samples - 1) > 0)
          if (.not. any(meets)) meets(max(minloc(abs(phase_difference), dim=1) - 1, 1)) = .true.
          do k = 1, samples
            if (.not. meets(k) .or. sin(aimag(z(j, k))) < below) cycle
            associate (a => phase_difference(k - 1), b => phase_difference(k))
              x = merge(0, 1, abs(a) < abs(b))
              if ((a > 0) .neqv. (b > 0)) x = a / (a - b)
              places = [places, place_type(number, pair_indices_type(i, j, turns), (k - 1 + x) / samples, &
                & (b - a) * samples / stretch%length())]
            end associate
          end do
        end do
      end do
    end do
  end function meetings_on

end module gestell_task_boundary_line_places
