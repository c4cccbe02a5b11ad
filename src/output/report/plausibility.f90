!> Motions that no machine has: as a rule a unit was forgotten.
module gestell_output_report_plausibility
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: implausible_lines

  character, parameter :: newline = new_line("a")
  !> m/s: a ring of steel that turns so fast bears rho v^2 = 2 GPa, more than it can.
  real(dp), parameter :: fastest = 500
  !> m/s^2, ten thousand times that of a fall.
  real(dp), parameter :: greatest_acceleration = 1.0e5_dp
  !> m: extent of a mechanism.
  real(dp), parameter :: widest = 20, narrowest = 1.0e-3_dp
  integer, parameter :: samples = 72

contains

  !> A note for what is beyond these limits, mechanisms of joints only; empty where nothing is.
  function implausible_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    real(dp) :: speed, acceleration, extent
    integer :: fast, quick

    lines = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call extremes(mechanism, abs(frame%speed), speed, fast, acceleration, quick, extent)
      if (speed > fastest) then
        lines = note("joint '" // mechanism%joints(fast)%name // "' moves with " // up_to(speed) // " m/s, above " &
          & // concise(fastest))
      else if (acceleration > greatest_acceleration) then
        lines = note("joint '" // mechanism%joints(quick)%name // "' is accelerated with " // up_to(acceleration) &
          & // " m/s^2, above " // concise(greatest_acceleration))
      end if
      if (extent > widest) lines = lines // note("the mechanism is " // concise(extent, 3) // " m wide, above " // concise(widest))
      if (extent < narrowest) lines = lines // note("the mechanism is " // concise(extent, 3) // " m wide, below " &
        & // concise(narrowest))
    end select
  end function implausible_lines

  !> "up to 23.4", and of what overflows that it does.
  pure function up_to(value) result(words)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: words

    words = "up to " // concise(value, 3)
    if (value > huge(value)) words = "more than " // concise(huge(value), 3)
  end function up_to

  pure function note(words) result(line)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: line

    line = "  note       " // words // ": are the units right? They are m, kg, N, s where &units says nothing else" // newline
  end function note

  !> The greatest speed (m/s) and acceleration (m/s^2) of a joint with their joints' numbers, the crank turning with `omega`
  !> (rad/s), and the extent of all that they reach (m).
  subroutine extremes(linkage, omega, speed, fast, acceleration, quick, extent)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: omega
    real(dp), intent(out) :: speed, acceleration, extent
    integer, intent(out) :: fast, quick
    type(point_type) :: at(size(linkage%joints))
    real(dp), dimension(size(linkage%joints)) :: first, second
    real(dp) :: low(2), high(2)
    integer :: k

    first = 0
    second = 0
    low = huge(1.0_dp)
    high = -huge(1.0_dp)
    do k = 0, samples - 1
      call linkage%points(2 * pi * k / samples, at)
      first = max(first, hypot(at%x%d, at%y%d))
      second = max(second, hypot(at%x%dd, at%y%dd))
      low = min(low, [minval(at%x%v), minval(at%y%v)])
      high = max(high, [maxval(at%x%v), maxval(at%y%v)])
    end do
    fast = maxloc(first, dim=1)
    quick = maxloc(second, dim=1)
    speed = first(fast) * omega
    acceleration = second(quick) * omega**2
    extent = maxval(high - low)
  end subroutine extremes

end module gestell_output_report_plausibility
