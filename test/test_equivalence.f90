!> The same machine described in another way gives the same results; balance; linkages close to their limits.
module test_equivalence
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: mass_functions_type
  use machines, only: frame_of_machine, linkage_of_machine
  use reference_cases, only: random_linkage
  use reference_frame, only: frame_of, frame_period
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_equivalence

  integer, parameter :: machines_tried = 15

contains

  subroutine collect_equivalence(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a machine turned by an angle has the same results, turned", test_turned), &
      & new_unittest("shifting the mechanism's origin leaves the results unchanged", test_shifted), &
      & new_unittest("a mirrored machine run in reverse has mirrored results", test_mirrored), &
      & new_unittest("scaling length, mass and time scales all results accordingly", test_scaled), &
      & new_unittest("a force-balanced four-bar exerts only a moment", test_balanced), &
      & new_slow("machines close to a change point are correct or refused", test_change_point)]
  end subroutine collect_equivalence

  !> Multipliers of a machine that only supports hold, without a foundation.
  subroutine solve(machine, multipliers, error)
    type(machine_data), intent(in) :: machine
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure

    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(tolerance=1.0e-11_dp), .false., monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
    call check_success(error, failure)
  end subroutine solve

  subroutine compare(machine, other, error)
    type(machine_data), intent(in) :: machine, other
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: one, two
    integer :: k

    call solve(machine, one, error)
    if (allocated(error)) return
    call solve(other, two, error)
    if (allocated(error)) return
    do k = 1, size(one%rho)
      ! Both have their own bound; within the sum of both they agree.
      call check_that(error, minval(abs(two%rho - one%rho(k)) - abs(two%rho) * two%error), "<=", abs(one%rho(k)) * one%error(k), &
        & "nearest multiplier")
      if (allocated(error)) return
    end do
  end subroutine compare

  function held_by_supports(number) result(machine)
    integer, intent(in) :: number
    type(machine_data) :: machine

    machine = random_linkage(number)
    machine%foundation_stiffness = 0
    machine%foundation_damping = 0
  end function held_by_supports

  pure function turned(u, angle_deg) result(w)
    real(dp), intent(in) :: u(2), angle_deg
    real(dp) :: w(2)

    associate (c => cosd_(angle_deg), s => sind_(angle_deg))
      w = [c * u(1) - s * u(2), s * u(1) + c * u(2)]
    end associate
  end function turned

  pure real(dp) function cosd_(angle_deg)
    real(dp), intent(in) :: angle_deg
    cosd_ = cos(angle_deg * acos(-1.0_dp) / 180)
  end function cosd_

  pure real(dp) function sind_(angle_deg)
    real(dp), intent(in) :: angle_deg
    sind_ = sin(angle_deg * acos(-1.0_dp) / 180)
  end function sind_

  subroutine test_turned(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine, other
    real(dp), parameter :: angle = 37.0_dp
    integer :: i, k

    do i = 1, machines_tried
      machine = held_by_supports(i)
      other = machine
      other%origin = turned(machine%origin, angle)
      do k = 1, size(machine%joints)
        associate (joint => other%joints(k))
          joint%position = turned(joint%position, angle)
          if (joint%kind == "crank") joint%phase_deg = joint%phase_deg + angle
          if (joint%guide(1) == 0) joint%guide_point = turned(joint%guide_point, angle)
          if (joint%guide(1) == 0) joint%guide_angle_deg = joint%guide_angle_deg + angle
          if (joint%guide2(1) == 0) joint%guide2_point = turned(joint%guide2_point, angle)
          if (joint%guide2(1) == 0) joint%guide2_angle_deg = joint%guide2_angle_deg + angle
        end associate
      end do
      do k = 1, size(machine%links)
        if (machine%links(k)%to == 0) other%links(k)%center = turned(machine%links(k)%center, angle)
      end do
      do k = 1, size(machine%supports)
        other%supports(k)%position = turned(machine%supports(k)%position, angle)
        other%supports(k)%angle_deg = machine%supports(k)%angle_deg + angle
      end do
      call compare(machine, other, error)
      if (allocated(error)) return
    end do
  end subroutine test_turned

  subroutine test_shifted(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine, other
    real(dp), parameter :: shift(2) = [0.31_dp, -0.17_dp]
    integer :: i, k

    do i = 1, machines_tried
      machine = held_by_supports(20 + i)
      other = machine
      other%origin = machine%origin - shift
      do k = 1, size(machine%joints)
        associate (joint => other%joints(k))
          joint%position = joint%position + shift
          if (joint%guide(1) == 0) joint%guide_point = joint%guide_point + shift
          if (joint%guide2(1) == 0) joint%guide2_point = joint%guide2_point + shift
        end associate
      end do
      call compare(machine, other, error)
      if (allocated(error)) return
    end do
  end subroutine test_shifted

  !> Mirrored at the x-axis: y, angles, the sense of rotation and the side of a dyad change their sign.
  subroutine test_mirrored(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine, other
    integer :: i, k

    do i = 1, machines_tried
      machine = held_by_supports(40 + i)
      other = machine
      other%speed_rpm = -machine%speed_rpm
      other%origin(2) = -machine%origin(2)
      do k = 1, size(machine%joints)
        associate (joint => other%joints(k))
          joint%position(2) = -joint%position(2)
          joint%phase_deg = -joint%phase_deg
          joint%offset(2) = -joint%offset(2)
          joint%guide_point(2) = -joint%guide_point(2)
          joint%guide2_point(2) = -joint%guide2_point(2)
          joint%guide_angle_deg = -joint%guide_angle_deg
          joint%guide2_angle_deg = -joint%guide2_angle_deg
          joint%slot_angle_deg = -joint%slot_angle_deg
          if (joint%kind == "RRR") joint%branch = -joint%branch
        end associate
      end do
      do k = 1, size(machine%links)
        other%links(k)%center(2) = -machine%links(k)%center(2)
      end do
      do k = 1, size(machine%supports)
        other%supports(k)%position(2) = -machine%supports(k)%position(2)
        other%supports(k)%angle_deg = -machine%supports(k)%angle_deg
      end do
      call compare(machine, other, error)
      if (allocated(error)) return
    end do
  end subroutine test_mirrored

  subroutine test_scaled(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine, other
    real(dp), parameter :: length = 1.0e-3_dp, mass = 40.0_dp, time = 7.0_dp
    integer :: i, k

    do i = 1, machines_tried
      machine = held_by_supports(60 + i)
      other = machine
      other%speed_rpm = machine%speed_rpm / time
      other%origin = machine%origin * length
      other%frame_mass = machine%frame_mass * mass
      other%frame_inertia = machine%frame_inertia * mass * length**2
      do k = 1, size(machine%joints)
        associate (joint => other%joints(k))
          joint%position = joint%position * length
          joint%radius = joint%radius * length
          joint%lengths = joint%lengths * length
          joint%offset = joint%offset * length
          joint%guide_point = joint%guide_point * length
          joint%guide2_point = joint%guide2_point * length
        end associate
      end do
      do k = 1, size(machine%links)
        associate (link => other%links(k))
          link%center = link%center * length
          link%mass = link%mass * mass
          link%inertia = link%inertia * mass * length**2
        end associate
      end do
      do k = 1, size(machine%supports)
        associate (support => other%supports(k))
          support%position = support%position * length
          support%stiffness = support%stiffness * mass / time**2
          support%damping = support%damping * mass / time
        end associate
      end do
      call compare(machine, other, error)
      if (allocated(error)) return
    end do
  end subroutine test_scaled

  !> R. S. Berkof, G. G. Lowen: A new method for completely force balancing simple linkages, J. Eng. Ind. 91 (1969) 21:
  !> with the coupler's centre of mass at r3 of its length a3, counterweights m2 r2 = m3 a2 (a3 - r3)/a3 and
  !> m4 r4 = m3 a4 r3/a3, opposite to crank and rocker, hold the common centre of mass at rest.
  subroutine test_balanced(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(mass_functions_type) :: a, first
    type(gestell_error), allocatable :: failure
    real(dp) :: r3, force, moment
    integer :: k

    machine = khang_machine(240.0_dp)
    associate (coupler => machine%links(2), a2 => 0.07_dp, a3 => 0.37_dp, a4 => 0.16_dp)
      r3 = coupler%center(1)
      machine%links(1)%center = [-coupler%mass * a2 * (a3 - r3) / a3 / machine%links(1)%mass, 0.0_dp]
      machine%links(3)%center = [-coupler%mass * a4 * r3 / a3 / machine%links(3)%mass, 0.0_dp]
    end associate
    call linkage_of_machine(machine, linkage, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    force = 0
    call linkage%mass_functions(0.0_dp, first)
    moment = 0
    do k = 1, 50
      call linkage%mass_functions(0.13_dp * k, a)
      force = max(force, hypot(a%a1%dd, a%a2%dd), abs(a%a1%v - first%a1%v), abs(a%a2%v - first%a2%v))
      moment = max(moment, abs(a%a4))
    end do
    ! Single terms of the sum are of size 0.05 kg m.
    call check_that(error, force, "<", 1.0e-16_dp, "force")
    call check_that(error, moment, ">", 1.0e-3_dp, "moment")
  end subroutine test_balanced

  !> The paper's machine with a ground link so long that crank and ground in line almost stretch the dyad, so short that they
  !> almost fold it, and with a slider that its rod almost fails to reach. Every claim agrees with the reference, for any gap.
  subroutine test_change_point(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: gap(3) = [1.0e-2_dp, 1.0e-3_dp, 1.0e-6_dp]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(qp) :: phi(6, 6), xp(6), x0(6)
    complex(qp) :: rho(6)
    integer :: i, k, variant

    do i = 1, 3 * size(gap)
      variant = 1 + (i - 1) / size(gap)
      machine = khang_machine(240.0_dp)
      associate (length => 0.37_dp * gap(1 + modulo(i - 1, size(gap))))
        select case (variant)
        case (1)
          machine%joints(2)%position = [0.37_dp + 0.16_dp - 0.07_dp - length, 0.0_dp]
        case (2)
          machine%joints(2)%position = [0.37_dp - 0.16_dp + 0.07_dp + length, 0.0_dp]
        case default
          machine%joints(4)%kind = "RRP"
          machine%joints(4)%guide_point = [0.0_dp, -(0.37_dp - 0.07_dp - length)]
        end select
      end associate
      call frame_of_machine(machine, frame, failure)
      if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(), .true., monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call frame_period(frame_of(machine), 1.0e-22_qp, phi, xp, x0)
      call eigenvalues(phi, rho)
      do k = 1, 6
        call check_that(error, minval(abs(cmplx(rho, kind=dp) - multipliers%rho(k))), "<=", multipliers%error(k) &
          & * abs(multipliers%rho(k)), "multipliers")
        if (allocated(error)) return
      end do
      call check_that(error, real(abs(solution%x0 - x0), dp), "<=", solution%error, "x0")
      call check_that(error, multipliers%error, "<", 1.0e-6_dp, "useful bounds")
      if (allocated(error)) return
    end do
  end subroutine test_change_point

end module test_equivalence
