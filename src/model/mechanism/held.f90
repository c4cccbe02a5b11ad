!> What keeps the crank's speed constant, and the effective mass functions: the moving masses as they act on the frame, (39) to
!> (43) of doc/theory.md.
!>
!> | held by    | turns uniformly                             | moment on the frame due to the torque M_d on the crank  |
!> |------------|---------------------------------------------|---------------------------------------------------------|
!> | `motor`    | the crank relative to the frame: phi        | all of M_d: the motor stands on the frame               |
!> | `outside`  | the crank relative to the ground: phi + psi | none: the drive stands next to the frame                |
!> | `flywheel` | the crank relative to the ground: phi + psi | mean of M_d, from the motor on the frame                |
!>
!> For `outside` and `flywheel` phi = Omega t - p psi, where p = 1, or p = 1/q if the drive turns q times per turn of phi. If only
!> the frame rotates, by dpsi, the drive does not rotate relative to the ground. A mass at r = O + x + i y then moves by
!> (i r - p r') dpsi instead of i r dpsi, where ' = d/dphi. Let S = sum m r be the first moment of the masses about F and J their
!> moment of inertia. Let A = sum (m r x r' + J_i phi_i') and K = sum (m |r'|^2 + J_i phi_i'^2). In the equations of the frame S
!> and J are replaced by
!>
!>     S_1 = S + i p S',   J_1 = J - 2 p A + p^2 K.
!>
!> These have the form of the original sums, with a1 - p a2', a2 + p a1', a3 - 2 p H + p^2 K in place of a1, a2, a3. Therefore (9)
!> to (11) remain valid. The moment of the load is A' - p K'/2 in place of A' (times -Omega^2), and depends on psi.
module gestell_model_mechanism_held
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_ddd, a1_v, a2_d, a2_dd, a2_ddd, a2_v, a3_d, a3_dd, a3_v, a4_v, drive_columns, &
    & energy_d, energy_dd, energy_v, mechanism_type, spin_dd, spin_v, table_columns
  implicit none (type, external)
  private

  public :: check_held, check_uniform_turn, part_of_turn, sum_or_zero, tabulate_effective

  character(len=8), parameter, public :: holders(3) = [character(len=8) :: "motor", "flywheel", "outside"]
  !> Name of the input key to which the error messages of `check_held` refer.
  character(len=*), parameter, public :: held_subject = "held_by"

contains

  !> Checks what keeps the speed constant. Fails if `held_by` is unknown, if `check_uniform_turn` fails, if the mechanism has no
  !> data on its energy, or if its mass functions are physically impossible (no set of masses has these functions).
  subroutine check_held(held_by, mechanism, error)
    character(len=*), intent(in) :: held_by
    class(mechanism_type), intent(in) :: mechanism
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: angles = 64
    real(dp), parameter :: rounding = 1.0e-6_dp
    real(dp), dimension(angles, table_columns) :: masses, effective
    real(dp) :: drive(1, drive_columns)
    logical :: known
    integer :: k

    if (.not. any(holders == held_by)) then
      call fatal_error(error, "held_by must be 'motor', 'flywheel' or 'outside', not '" // held_by // "'", invalid_input, &
        & held_subject)
    else if (held_by /= "motor") then
      call check_uniform_turn(held_by, mechanism, error)
      if (allocated(error)) return
      call mechanism%tabulate_drive([0.0_dp], drive, known)
      if (.not. known) then
        call fatal_error(error, "held_by = '" // trim(held_by) // "' requires the kinetic energy of the mechanism: add the " // &
          &   "key energy to &mass_functions", invalid_input, held_subject)
        return
      end if
      call mechanism%tabulate([(2 * pi * k / angles, k = 1, angles)], masses)
      call tabulate_effective(mechanism, [0.0_dp, 0.0_dp], .true., [(2 * pi * k / angles, k = 1, angles)], effective)
      if (any(mechanism%mass * (mechanism%inertia + effective(:, a3_v)) < (1 - rounding) * (effective(:, a1_v)**2 + effective(:, &
        & a2_v)**2) - rounding * mechanism%mass * (mechanism%inertia + masses(:, a3_v)))) call fatal_error(error, &
        & "the energy is physically impossible together with a1, a2, a3 and moment", invalid_input, held_subject)
    end if
  end subroutine check_held

  !> Fails if the drive should turn uniformly relative to the ground, but there is no crank, or accelerations jump. (The equations
  !> of the frame then contain the derivatives of the accelerations.)
  pure subroutine check_uniform_turn(held_by, mechanism, error)
    character(len=*), intent(in) :: held_by
    class(mechanism_type), intent(in) :: mechanism
    type(error_type), allocatable, intent(out) :: error

    if (held_by == "motor") return
    if (.not. mechanism%has_crank) then
      call fatal_error(error, "held_by = '" // trim(held_by) // "' requires a crank: a cylinder has no shaft", invalid_input, &
        & held_subject)
    else if (mechanism%jumps) then
      call fatal_error(error, "held_by = '" // trim(held_by) // "' requires cam laws without jumps of the acceleration", &
        & invalid_input, held_subject)
    end if
  end subroutine check_uniform_turn

  !> Tabulates the effective mass functions (the moving masses as they act on the frame) and the load.
  subroutine tabulate_effective(mechanism, origin, uniform_in_space, angles, effective, load, slope)
    class(mechanism_type), intent(in) :: mechanism
    !> Origin of the mechanism relative to the frame's centre of mass (m)
    real(dp), intent(in) :: origin(2)
    !> True if the crank turns uniformly relative to the ground, false if it turns uniformly relative to the frame
    logical, intent(in) :: uniform_in_space
    !> Crank angles (rad)
    real(dp), contiguous, intent(in) :: angles(:)
    !> Effective mass functions, shape (angles, table_columns); column a4 is 0 if the crank turns uniformly relative to the ground
    real(dp), contiguous, intent(out) :: effective(:, :)
    !> `load`: two forces and the moment about the crank's pivot, each divided by -Omega^2, shape (angles, 3). `slope`: derivative
    !> with respect to psi of the load's moment about the frame's centre of mass, divided by +Omega^2, shape (angles)
    real(dp), contiguous, intent(out), optional :: load(:, :), slope(:)
    real(dp), allocatable :: masses(:, :), drive(:, :)
    real(dp) :: part
    logical :: known

    if (.not. uniform_in_space) then
      call mechanism%tabulate(angles, effective)
      if (present(load)) load = effective(:, [a1_dd, a2_dd, a4_v])
      if (present(slope)) slope = 0
      return
    end if
    allocate(masses(size(angles), table_columns), drive(size(angles), drive_columns))
    call mechanism%tabulate(angles, masses)
    call mechanism%tabulate_drive(angles, drive, known)
    part = part_of_turn(mechanism, uniform_in_space)
    effective(:, a1_v) = sum_or_zero(masses(:, a1_v), -part * masses(:, a2_d))
    effective(:, a1_d) = sum_or_zero(masses(:, a1_d), -part * masses(:, a2_dd))
    effective(:, a1_dd) = sum_or_zero(masses(:, a1_dd), -part * drive(:, a2_ddd))
    effective(:, a2_v) = sum_or_zero(masses(:, a2_v), part * masses(:, a1_d))
    effective(:, a2_d) = sum_or_zero(masses(:, a2_d), part * masses(:, a1_dd))
    effective(:, a2_dd) = sum_or_zero(masses(:, a2_dd), part * drive(:, a1_ddd))
    effective(:, a3_v) = masses(:, a3_v) - 2 * part * drive(:, spin_v) + part**2 * drive(:, energy_v)
    effective(:, a3_d) = masses(:, a3_d) - 2 * part * masses(:, a4_v) + part**2 * drive(:, energy_d)
    effective(:, a3_dd) = masses(:, a3_dd) - 2 * part * drive(:, spin_dd) + part**2 * drive(:, energy_dd)
    effective(:, a4_v) = 0
    if (present(load)) then
      load = masses(:, [a1_dd, a2_dd, a4_v])
      load(:, 3) = load(:, 3) - part * drive(:, energy_d) / 2
    end if
    if (present(slope)) slope = part * (drive(:, spin_dd) - part * drive(:, energy_dd) / 2 + origin(1) * drive(:, a2_ddd) &
      & - origin(2) * drive(:, a1_ddd))
  end subroutine tabulate_effective

  !> Factor p in the crank angle phi = Omega t - p psi, where psi is the rotation of the frame; 0 if the crank turns uniformly
  !> relative to the frame.
  pure real(dp) function part_of_turn(mechanism, uniform_in_space) result(part)
    class(mechanism_type), intent(in) :: mechanism
    logical, intent(in) :: uniform_in_space

    part = 0
    if (uniform_in_space) part = 1.0_dp / mechanism%turns
  end function part_of_turn

  !> The sum a + b, or zero if the sum is only a rounding error. Without this, the terms of an unbalance that turns uniformly
  !> relative to the ground would not cancel exactly, and a spurious mass that turns with the frame would remain.
  elemental real(dp) function sum_or_zero(a, b)
    real(dp), intent(in) :: a, b

    sum_or_zero = a + b
    if (abs(sum_or_zero) <= 8 * epsilon(1.0_dp) * (abs(a) + abs(b))) sum_or_zero = 0
  end function sum_or_zero

end module gestell_model_mechanism_held
