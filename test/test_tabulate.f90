!> Tables of the mass functions: against single angles, which are computed by jets, and against quadruple precision.
module test_tabulate
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: batch, path_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, mechanism_type, &
    & table_columns
  use machines, only: linkage_of_machine, new_crank
  use reference_cases, only: random_linkage
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move, reference_functions => mass_functions, &
    & reference_functions_type => mass_functions_type
  use reference_machine, only: joint_data, khang_machine, machine_data
  use slow_tests, only: new_slow
  use tables, only: many, one_by_one, some_angles
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use user_mechanisms, only: handle_joint, pendulum_type
  implicit none (type, external)
  private

  public :: collect_tabulate

contains

  subroutine collect_tabulate(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("tabulated joints of random linkages agree with jets and reference", test_paths), &
      & new_slow("tables of random linkages agree with jets and reference", test_tables), &
      & new_unittest("each tabulated row is independent of the other angles", test_remainders), &
      & new_unittest("near dead points tables lose only the predicted digits", test_dead_points), &
      & new_unittest("tabulation of a balanced crank leaves no shaking; small unbalance remains", test_balanced), &
      & new_unittest("a tabulated force-balanced four-bar exerts no force", test_balanced_four_bar), &
      & new_unittest("a user's joint without tabulation of its own is tabulated", test_user_joint), &
      & new_unittest("a user's mechanism without tabulation of its own is tabulated", test_user_mechanism), &
      & new_unittest("tabulated harmonics of different orders agree with the closed form", test_harmonics), &
      & new_unittest("a linkage with fifty joints is tabulated correctly", test_long_linkage)]
  end subroutine collect_tabulate

  subroutine random_pair(number, machine, linkage, error)
    integer, intent(in) :: number
    type(machine_data), intent(out) :: machine
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    machine = random_linkage(number)
    call linkage_of_machine(machine, linkage, failure)
    call check_success(error, failure)
  end subroutine random_pair

  subroutine test_paths(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(motion_type) :: motion
    type(point_type), allocatable :: at(:)
    type(path_type), allocatable :: path(:)
    real(dp) :: angles(batch), here(6)
    integer :: i, j, k, moving_guides

    angles = some_angles(batch)
    moving_guides = 0
    do i = 1, 300
      call random_pair(2000 + i, machine, linkage, error)
      if (allocated(error)) return
      if (allocated(at)) deallocate(at, path)
      allocate(at(size(machine%joints)), path(size(machine%joints)))
      moving_guides = moving_guides + count(machine%joints%guide(1) > 0)
      do j = 1, size(path)
        call linkage%joints(j)%joint%trace(angles, path(:j - 1), path(j))
      end do
      do k = 1, batch
        call linkage%points(angles(k), at)
        if (k == 1 + modulo(i, batch)) motion = move(machine, real(angles(k), qp))
        do j = 1, size(path)
          here = [path(j)%x(k), path(j)%y(k), path(j)%vx(k), path(j)%vy(k), path(j)%ax(k), path(j)%ay(k)]
          ! Sizes of 1 m; up to four dyads with a sine of the transmission angle above 0.3 amplify rounding.
          call check_that(error, maxval(abs(here - [at(j)%x%v, at(j)%y%v, at(j)%x%d, at(j)%y%d, at(j)%x%dd, at(j)%y%dd])), "<", &
            & 1.0e-11_dp, "jets")
          if (allocated(error)) return
          if (k /= 1 + modulo(i, batch)) cycle
          call check_that(error, real(maxval(abs(here - reshape(motion%joint(:, :, j), [6]))), dp), "<", 1.0e-11_dp, "reference")
          if (allocated(error)) return
        end do
      end do
    end do
    call check_that(error, moving_guides, ">", 50, "moving guides among them")
  end subroutine test_paths

  !> One row of the table from the reference.
  function reference_row(machine, angle) result(row)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: angle
    real(qp) :: row(table_columns)
    type(reference_functions_type) :: r

    r = reference_functions(machine, real(angle, qp))
    row([a1_v, a1_d, a1_dd]) = r%a1
    row([a2_v, a2_d, a2_dd]) = r%a2
    row([a3_v, a3_d, a3_dd]) = r%a3
    row(a4_v) = r%a4
  end function reference_row

  subroutine test_tables(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    real(dp), dimension(many, table_columns) :: table, jets
    real(dp) :: angles(many), magnitude
    integer :: i, k

    angles = some_angles(many)
    do i = 1, 300
      call random_pair(3000 + i, machine, linkage, error)
      if (allocated(error)) return
      call linkage%tabulate(angles, table)
      call one_by_one(linkage, angles, jets)
      ! As for the paths; a1 to a3 and their derivatives carry the masses.
      magnitude = maxval(abs(jets))
      call check_that(error, maxval(abs(table - jets)), "<", 1.0e-11_dp * magnitude, "jets")
      if (allocated(error)) return
      k = 1 + modulo(i, many)
      call check_that(error, real(maxval(abs(table(k, :) - reference_row(machine, angles(k)))), dp), "<", 1.0e-11_dp * magnitude, &
        & "reference")
      if (allocated(error)) return
    end do
  end subroutine test_tables

  !> A row is the same to the last bit, whatever other angles are in its batch.
  subroutine test_remainders(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(8) = [0, 1, batch - 1, batch, batch + 1, 2 * batch, 2 * batch + 1, 200]
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(harmonic_mechanism_type) :: harmonic
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: angles(:)
    integer :: i

    call random_pair(1, machine, linkage, error)
    if (allocated(error)) return
    call new_harmonic_mechanism(harmonic, 3.0_dp, 0.1_dp, [0.1_dp, 0.2_dp, 0.3_dp], [0.0_dp], [5.0_dp], [0.0_dp, 1.0_dp, 2.0_dp], &
      & failure)
    do i = 1, size(counts)
      angles = some_angles(counts(i))
      call compare(linkage)
      if (allocated(error)) return
      call compare(harmonic)
      if (allocated(error)) return
    end do

  contains

    subroutine compare(mechanism)
      class(mechanism_type), intent(in) :: mechanism
      real(dp), allocatable :: table(:, :)
      real(dp) :: row(1, table_columns)
      integer :: k

      allocate(table(size(angles), table_columns))
      call mechanism%tabulate(angles, table)
      do k = 1, size(angles)
        call mechanism%tabulate(angles(k:k), row)
        call check(error, maxval(abs(table(k, :) - row(1, :))), 0.0_dp)
        if (allocated(error)) return
      end do
    end subroutine compare

  end subroutine test_remainders

  !> Four-bars close to both change points and a slider-crank whose rod almost stands across the guide. Where the angle scale
  !> is about the sine of the transmission angle, lengths lose twice its digits.
  subroutine test_dead_points(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: gap(4) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-6_dp, 1.0e-7_dp]
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(qp), dimension(batch, table_columns) :: known
    real(dp) :: table(batch, table_columns), angles(batch), worst
    integer :: i, k, variant

    do i = 1, 3 * size(gap)
      variant = 1 + (i - 1) / size(gap)
      machine = khang_machine(240.0_dp)
      associate (length => 0.37_dp * gap(1 + modulo(i - 1, size(gap))))
        select case (variant)
        case (1)
          machine%joints(2)%position = [0.37_dp + 0.16_dp - 0.07_dp - length, 0.0_dp]
          worst = pi
        case (2)
          machine%joints(2)%position = [0.37_dp - 0.16_dp + 0.07_dp + length, 0.0_dp]
          worst = 0
        case default
          machine%joints(4)%kind = "RRP"
          machine%joints(4)%guide_point = [0.0_dp, -(0.37_dp - 0.07_dp - length)]
          worst = pi / 2
        end select
      end associate
      call linkage_of_machine(machine, linkage, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      angles = [(worst + linkage%angle_scale * (k - batch / 2) / 4, k = 1, batch)]
      call linkage%tabulate(angles, table)
      do k = 1, batch
        known(k, :) = reference_row(machine, angles(k))
      end do
      do k = 1, table_columns
        ! Three powers of the sine in the second derivatives, each with the roundings of some lengths.
        call check_that(error, real(maxval(abs(table(:, k) - known(:, k))) / maxval(abs(known(:, k))), dp), "<", 8 &
          & * epsilon(1.0_dp) / linkage%angle_scale**2, "column of the table")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_dead_points

  !> m c of the crank's two bodies cancel but for the rounding of the products, wherever the pivot is.
  subroutine test_balanced(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: shaking(5) = [a1_d, a1_dd, a2_d, a2_dd, a4_v]
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(dp) :: table(many, table_columns), center(2), unbalance, mass
    integer :: i

    do i = 1, 80
      unbalance = merge(0.0_dp, 1.0e-9_dp, modulo(i, 2) == 0)
      center = 0.1_dp * i / 7 * [1.0_dp, merge(0.0_dp, 1 / 7.0_dp, i > 40)]
      mass = 0.7_dp * i / 11
      linkage = linkage_type()
      call linkage%ground("O", merge([0.0_dp, 0.0_dp], [0.31_dp, -0.23_dp], modulo(i, 4) < 2), failure)
      call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
      call linkage%link("crank", "O", "A", mass, 0.0_dp, center, failure)
      call linkage%link("counterweight", "O", "A", 3 * mass, 0.0_dp, -center / 3 * (1 + unbalance), failure)
      call linkage%tabulate(some_angles(many), table)
      if (unbalance > 0) then
        ! Known to roundings of the two parts.
        call check_that(error, maxval(abs(hypot(table(:, a1_d), table(:, a2_d)) - mass * norm2(center) * unbalance)), "<", &
          & 1.0e-15_dp * mass * norm2(center), "unbalance")
      else
        call check(error, maxval(abs(table(:, shaking))), 0.0_dp, more="balanced")
        if (allocated(error)) return
        if (modulo(i, 4) < 2) call check(error, maxval(abs(table(:, [a1_v, a2_v]))), 0.0_dp, more="balanced about O")
      end if
      if (allocated(error)) return
    end do
  end subroutine test_balanced

  !> The coupler's mass shared out to its joints and balanced there: no force, but a moment.
  subroutine test_balanced_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(dp) :: table(many, table_columns)

    machine = khang_machine(240.0_dp)
    associate (coupler => machine%links(2), a2 => 0.07_dp, a3 => 0.37_dp, a4 => 0.16_dp)
      machine%links(1)%center(1) = -coupler%mass * a2 * (a3 - coupler%center(1)) / a3 / machine%links(1)%mass
      machine%links(3)%center(1) = -coupler%mass * a4 * coupler%center(1) / a3 / machine%links(3)%mass
    end associate
    call linkage_of_machine(machine, linkage, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call linkage%tabulate(some_angles(many), table)
    ! Single terms of the sums are of size 0.05 kg m.
    call check_that(error, maxval(abs(table(:, [a1_d, a2_d, a1_dd, a2_dd]))), "<", 1.0e-16_dp, "terms that vanish")
    call check_that(error, maxval(abs(table(:, a4_v))), ">", 1.0e-3_dp, "a4")
  end subroutine test_balanced_four_bar

  !> The user's joint is equivalent to a second crank, and others are built on it.
  subroutine test_user_joint(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage(2)
    type(gestell_error), allocatable :: failure
    real(dp), dimension(many, table_columns) :: users, own
    integer :: i

    do i = 1, 2
      call new_crank(linkage(i), failure)
      call linkage(i)%ground("P", [4.5_dp, 0.0_dp], failure)
      call linkage(i)%rrr("B", ["A", "P"], [4.0_dp, 2.5_dp], 1, failure)
      if (i == 1) call linkage(i)%add_joint("M", handle_joint(4, 0.5_dp), failure)
      if (i == 2) call linkage(i)%crank("M", "B", 0.5_dp, 0.0_dp, failure)
      call linkage(i)%ground("Q", [2.0_dp, 6.0_dp], failure)
      call linkage(i)%rrr("C", ["M", "Q"], [4.0_dp, 4.0_dp], -1, failure)
      call linkage(i)%link("link", "M", "C", 1.0_dp, 2.0_dp, [0.5_dp, 0.1_dp], failure)
    end do
    call linkage(1)%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call linkage(1)%tabulate(some_angles(many), users)
    call linkage(2)%tabulate(some_angles(many), own)
    ! Sizes up to 100 kg m^2, good angles.
    call check_that(error, maxval(abs(users - own)), "<", 1.0e-11_dp, "user's joint and built-in joint")
    call check_that(error, maxval(abs(own)), ">", 1.0_dp, "largest term")
  end subroutine test_user_joint

  subroutine test_user_mechanism(error)
    type(error_type), allocatable, intent(out) :: error
    type(pendulum_type) :: pendulum
    real(dp) :: table(many, table_columns), phi(many)

    phi = some_angles(many)
    call pendulum%tabulate(phi, table)
    ! Two or three roundings of numbers up to 9.
    call check_that(error, maxval(abs(table - reshape([cos(phi), -sin(phi), -cos(phi), 2 * sin(phi), 2 * cos(phi), -2 * sin(phi), &
      & 5 + cos(2 * phi), -2 * sin(2 * phi), -4 * cos(2 * phi), sin(3 * phi)], [many, table_columns]))), "<", 1.0e-14_dp, &
      & "closed form")
  end subroutine test_user_mechanism

  !> All series of different length, in closed form.
  subroutine test_harmonics(error)
    type(error_type), allocatable, intent(out) :: error
    type(harmonic_mechanism_type) :: mechanism
    type(gestell_error), allocatable :: failure
    real(dp) :: table(many, table_columns), single(many, table_columns)
    real(qp), dimension(many) :: p

    call new_harmonic_mechanism(mechanism, 3.0_dp, 0.1_dp, [0.1_dp, 0.2_dp, -0.3_dp, 0.0_dp, 0.25_dp], [0.5_dp], &
      & [5.0_dp, 0.5_dp, 1.0_dp], [9.0_dp, 0.0_dp, 0.0_dp, 0.5_dp, 0.25_dp, 2.0_dp, -1.0_dp], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    p = some_angles(many)
    call mechanism%tabulate(some_angles(many), table)
    call one_by_one(mechanism, some_angles(many), single)
    ! Up to 18 times the rounding of three times the angle.
    call check_that(error, maxval(abs(table - single)), "<", 1.0e-12_dp, "single angles")
    call check_that(error, maxval(abs(table - real(reshape([ 0.1_qp + 0.2_dp * cos(p) - 0.3_dp * sin(p) + 0.25_qp * sin(2 * p), &
      & -0.2_dp * sin(p) - 0.3_dp * cos(p) + 0.5_qp * cos(2 * p), -0.2_dp * cos(p) + 0.3_dp * sin(p) - 1.0_qp * sin(2 * p), &
      & 0.5_qp + 0 * p, 0 * p, 0 * p, 5 + 0.5_qp * cos(p) + sin(p), -0.5_qp * sin(p) + cos(p), -0.5_qp * cos(p) - sin(p), &
      & -sin(2 * p) + 0.5_qp * cos(2 * p) - 6 * sin(3 * p) - 3 * cos(3 * p)], [many, table_columns]), dp))), "<", 1.0e-12_dp, &
      & "closed form")
  end subroutine test_harmonics

  !> Fifty points along a crank.
  subroutine test_long_linkage(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(dp), dimension(many, table_columns) :: table, single
    character(len=3) :: name
    integer :: i

    call new_crank(linkage, failure)
    do i = 1, 50
      write (name, "(a, i0)") "P", i
      call linkage%rigid(name, ["O", "A"], [0.1_dp * i, 0.2_dp], failure)
      call linkage%link(name, name, "", 0.1_dp, 0.0_dp, [0.0_dp, 0.3_dp], failure)
    end do
    call check_success(error, failure)
    if (allocated(error)) return
    call linkage%tabulate(some_angles(many), table)
    call one_by_one(linkage, some_angles(many), single)
    ! Sums of fifty terms up to 50 kg m^2.
    call check_that(error, maxval(abs(table - single)), "<", 1.0e-12_dp, "single angles")
    call check_that(error, maxval(abs(table(:, a3_v))), ">", 10.0_dp, "a3")
  end subroutine test_long_linkage

end module test_tabulate
