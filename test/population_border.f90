!> Machines taken close to a border of stability, where ln rho_max is zero.
module population_border
  use population_library, only: largest_log_abs
  use reference_machine, only: dp, machine_data
  implicit none (type, external)
  private

  public :: damp_to_border, scale_damping, speed_to_border

contains

  subroutine scale_damping(machine, factor)
    type(machine_data), intent(inout) :: machine
    real(dp), intent(in) :: factor
    integer :: i

    machine%foundation_damping = factor * machine%foundation_damping
    do i = 1, size(machine%supports)
      machine%supports(i)%damping = factor * machine%supports(i)%damping
    end do
  end subroutine scale_damping

  !> Scales all dampers so that ln rho_max = -distance, or +distance if the machine is unstable without dampers. Changes nothing
  !> if no damping between zero and that of the machine achieves this.
  subroutine damp_to_border(machine, distance)
    type(machine_data), intent(inout) :: machine
    real(dp), intent(in) :: distance
    real(dp) :: value
    logical :: failed

    call measure(machine, "damping", 0.0_dp, value, failed)
    if (.not. failed) call approach(machine, "damping", [0.0_dp, 1.0_dp], merge(distance, -distance, value > 2 * distance))
  end subroutine damp_to_border

  !> Sets the speed to where ln rho_max = distance, between two of those tried from 1/3 to 3 times the machine's.
  subroutine speed_to_border(machine, distance)
    type(machine_data), intent(inout) :: machine
    real(dp), intent(in) :: distance
    integer, parameter :: tries = 16
    real(dp) :: factor(2), value(2)
    logical :: failed
    integer :: i

    factor(2) = 1.0_dp / 3
    call measure(machine, "speed", factor(2), value(2), failed)
    do i = 1, tries
      if (failed) return
      factor(1) = factor(2)
      value(1) = value(2)
      factor(2) = 3.0_dp**(2 * real(i, dp) / tries - 1)
      call measure(machine, "speed", factor(2), value(2), failed)
      if (failed .or. ((value(1) > distance) .eqv. (value(2) > distance))) cycle
      call approach(machine, "speed", factor, distance)
      return
    end do
  end subroutine speed_to_border

  !> The factor on `what` between two that makes ln rho_max = target, by regula falsi (Illinois), to roundoff if it can.
  subroutine approach(machine, what, between, target)
    type(machine_data), intent(inout) :: machine
    character(len=*), intent(in) :: what
    real(dp), intent(in) :: between(2), target
    real(dp) :: x(2), f(2), weight(2), middle, value
    logical :: failed
    integer :: i, side, last

    x = between
    weight = 1
    do i = 1, 2
      call measure(machine, what, x(i), f(i), failed)
      if (failed) return
    end do
    f = f - target
    if ((f(1) > 0) .eqv. (f(2) > 0)) return
    last = 0
    do i = 1, 30
      middle = (x(1) * weight(2) * f(2) - x(2) * weight(1) * f(1)) / (weight(2) * f(2) - weight(1) * f(1))
      call measure(machine, what, middle, value, failed)
      if (failed .or. abs(value - target) < 1.0e-3_dp * abs(target)) exit
      side = merge(1, 2, (value - target > 0) .eqv. (f(1) > 0))
      x(side) = middle
      f(side) = value - target
      weight(side) = 1
      if (side == last) weight(3 - side) = weight(3 - side) / 2
      last = side
    end do
    call scale(machine, what, middle)
  end subroutine approach

  subroutine scale(machine, what, factor)
    type(machine_data), intent(inout) :: machine
    character(len=*), intent(in) :: what
    real(dp), intent(in) :: factor

    if (what == "damping") call scale_damping(machine, factor)
    if (what == "speed") machine%speed_rpm = factor * machine%speed_rpm
  end subroutine scale

  !> ln rho_max of the machine with a factor on `what`.
  subroutine measure(machine, what, factor, value, failed)
    type(machine_data), intent(in) :: machine
    character(len=*), intent(in) :: what
    real(dp), intent(in) :: factor
    real(dp), intent(out) :: value
    logical, intent(out) :: failed
    type(machine_data) :: changed

    changed = machine
    call scale(changed, what, factor)
    call largest_log_abs(changed, value, failed)
  end subroutine measure

end module population_border
