!> The paper's Tables 2 and 3 beside the reconstructed original program and the right values; what the printed digits
!> pin down; the order of convergence of (18) as printed and corrected. Stops with an error if anything that
!> doc/validation.md claims does not come out.
program khang_tables
  use original_mechanism, only: dp, four_bar, heavier, crank_speed
  use original_program, only: program_options, as_printed, runge_kutta_weights, monodromy, initial_state
  use library_values, only: solve_by_library
  use printed_tables, only: speed_rpm, table_2, table_3, quantity, six_decimals
  use converged_flow, only: converged_monodromy, converged_initial_state, converged_motion, multiplier_moduli, liouville_exponent
  use table_3_evidence, only: reproduced, range_alone, range_together, distributions
  implicit none (type, external)

  !> Steps of the eighth-order reference: its error in Phi(T) is then below 1e-10
  integer, parameter :: reference_steps = 600
  !> By the library, at both speeds: right values and the errors that it claims
  real(dp) :: right_x0(6, 2), x0_error(6, 2), right_rho(2), rho_error(2)
  !> Displacements at `parts` + 1 crank angles of the turn, and the claimed errors
  integer, parameter :: parts = 12
  real(dp) :: turn(3, 0:parts, 2), turn_error(3, 2)
  integer :: failures, speed

  do speed = 1, 2
    call solve_by_library(speed_rpm(speed), right_x0(:, speed), x0_error(:, speed), right_rho(speed), rho_error(speed), &
      & turn(:, :, speed), turn_error(:, speed))
  end do
  failures = 0
  call show_table_3()
  call show_evidence()
  call show_table_2()
  call show_turn()
  call show_orders()
  if (failures > 0) error stop "khang_tables: a claim about the printed tables does not hold"
  print '(/,a)', 'All claims hold.'

contains

  !> Counts and names a claim that fails.
  subroutine claim(holds, what)
    logical, intent(in) :: holds
    character(len=*), intent(in) :: what

    if (holds) return
    failures = failures + 1
    print '(2a)', 'FAILED: ', what
  end subroutine claim

  subroutine show_table_3()
    real(dp), dimension(6) :: emulated, right, converged
    integer :: i, j

    print '(a)', 'Table 3: initial state of the periodic vibration; printed digits reproduced or not', &
        & 'emulated: RECONSTRUCTION of the original program; right: the periodic solution by the library'
    do i = 1, 2
      emulated = initial_state(four_bar(), crank_speed(speed_rpm(i)), as_printed)
      right = right_x0(:, i)
      converged = converged_initial_state(four_bar(), crank_speed(speed_rpm(i)), reference_steps)
      print '(/,a,i0,a)', 'n = ', nint(speed_rpm(i)), ' 1/min     printed   emulated                   right'
      do j = 1, 6
        print '(a,4x,a,2x,a,2x,a,f14.9,2x,a)', quantity(j), table_3(j, i), &
            & six_decimals(emulated(j)), comparison(emulated(j), table_3(j, i)), &
            & right(j), trim(comparison(right(j), table_3(j, i)))
      end do
      call claim(all(six_decimals(emulated) == table_3(:, i)), 'Table 3 digit for digit')
      ! The reference's own error is that of Phi, 1e-10 of entries up to 1000.
      call claim(all(abs(right - converged) < x0_error(:, i) + 1.0e-9_dp), 'right values of Table 3')
    end do
  end subroutine show_table_3

  !> Whether a value has the printed digits.
  pure function comparison(value, printed) result(word)
    real(dp), intent(in) :: value
    character(len=*), intent(in) :: printed
    character(len=9) :: word

    word = merge('equal    ', 'different', six_decimals(value) == printed)
  end function comparison

  subroutine show_evidence()
    real(dp), parameter :: weights(6) = [0.0_dp, 0.5_dp, 1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]
    real(dp), parameter :: box(2) = [20.0e-6_dp, 5.0_dp]
    type(four_bar) :: old_gravity
    real(dp) :: l1(2), k(2), extent(2, 2)
    real(dp), allocatable :: found(:, :)
    integer :: steps, hits(4), others(350:370), i, order

    print '(/,a)', 'What the digits of Table 3 pin down (values out of 12 that come out)'
    old_gravity%stiffness = 20000.0_dp * 9.81_dp
    hits(1) = reproduced(four_bar(), as_printed)
    hits(2) = reproduced(four_bar(), program_options(printed_order=.false.))
    hits(3) = reproduced(four_bar(), program_options(weights=runge_kutta_weights))
    hits(4) = reproduced(old_gravity, as_printed)
    print '(a,i3)', '  reconstruction                         ', hits(1), &
        & '  right order of factors, slip kept      ', hits(2), &
        & '  printed order of factors, without slip ', hits(3), &
        & '  200 kp/cm taken with 9.81 m/s^2        ', hits(4)
    call claim(all(hits(2:) < 12), 'every part of the reconstruction is needed')

    do steps = lbound(others, 1), ubound(others, 1)
      others(steps) = reproduced(four_bar(), program_options(steps=steps))
    end do
    others(360) = 0
    print '(a,i0)', '  most values with another number of steps from 350 to 370: ', maxval(others)
    call claim(maxval(others) < 12, 'Table 3 pins the number of steps')

    l1 = range_alone([box(1), 0.0_dp]) * box(1)
    k = range_alone([0.0_dp, box(2)]) * box(2)
    print '(a,2(sp,f8.2),a)', '  l1 = 0.4 m alone may move by      ', l1 * 1.0e6_dp, ' micrometres'
    print '(a,2(sp,f8.2),a)', '  k = 196133 N/m alone may move by  ', k, ' N/m'
    extent = range_together(as_printed, box, 250)
    print '(a,2(sp,f8.2),a,2(sp,f8.2),a)', '  both at a time: l1 by             ', extent(1, :) * 1.0e6_dp, &
        & ' micrometres, k by ', extent(2, :), ' N/m'
    call claim(maxval(abs(extent(1, :))) < 1.0e-5_dp .and. maxval(abs(extent(2, :))) < 3.0_dp, 'Table 3 pins l1 and k')
    extent = range_together(program_options(printed_order=.false.), box, 250)
    print '(a,l2)', '  any pair l1, k within 20 micrometres and 5 N/m with the right order of factors:', &
        & extent(1, 1) <= extent(1, 2)
    call claim(extent(1, 1) > extent(1, 2), 'Table 3 pins the printed order of factors')

    print '(a)', '  weights 0, 1/2, 1, 2, 3, 4 of the terms Pm f0, Pm fm, P1 fm | Pm^2 f0, P1 Pm fm | P1 Pm^2 f0,', &
        & '  Runge-Kutta = 1, that give all twelve:'
    do order = 1, 2
      found = distributions(order == 1, weights)
      print '(a,i0,a)', '    ' // merge('printed', 'right  ', order == 1) // ' order of factors: ', &
          & size(found, 2), ' of 46656'
      do i = 1, size(found, 2)
        print '(4x,3f5.1,a,2f5.1,a,f5.1)', found(1:3, i), ' |', found(4:5, i), ' |', found(6, i)
      end do
      call claim(size(found, 2) == merge(9, 0, order == 1), 'number of distributions of the slip')
    end do
  end subroutine show_evidence

  subroutine show_table_2()
    real(dp) :: omega, exponent, bound, moduli(6), rho_emulated
    integer :: i

    print '(/,a)', 'Table 2: largest modulus of the multipliers, with the Liouville bound rho_max >= det Phi(T)^(1/6)'
    print '(a)', '  n     printed     bound         emulated   right      integral of tr(M^-1 diag b)   ' &
        & // 'defect of det   damping needed'
    do i = 1, 2
      omega = crank_speed(speed_rpm(i))
      exponent = liouville_exponent(four_bar(), omega, 60)
      bound = exp(-exponent / 6)
      rho_emulated = maxval(multiplier_moduli(monodromy(four_bar(), omega, as_printed)))
      moduli = multiplier_moduli(converged_monodromy(four_bar(), omega, reference_steps))
      print '(i4,f12.6,f14.10,2f11.6,f20.12,es24.1,f12.1,a)', nint(speed_rpm(i)), table_2(i), bound, rho_emulated, &
          & right_rho(i), exponent, abs(product(moduli) * exp(exponent) - 1), -6 * log(table_2(i)) / exponent, &
          & ' times'
      call claim(table_2(i) < bound, 'Table 2 breaks the Liouville bound')
      call claim(min(rho_emulated, right_rho(i)) >= bound, 'our multipliers respect the Liouville bound')
      call claim(abs(exponent - liouville_exponent(four_bar(), omega, 90)) < 1.0e-14_dp, 'integral converged')
      call claim(abs(product(moduli) * exp(exponent) - 1) < 1.0e-9_dp, 'periodic part of B drops out of det Phi')
      call claim(abs(maxval(moduli) - right_rho(i)) < rho_error(i) + 1.0e-9_dp, 'right value of Table 2')
    end do
  end subroutine show_table_2

  !> The quantities of Bilder 3 to 5, whose curves are lost: right values, checked against the reference.
  subroutine show_turn()
    real(dp) :: x(6, 0:parts)
    integer :: i, k

    print '(/,a)', 'Bilder 3 to 5: the vibration over a turn, n = 240 and n = 360'
    print '(a)', '  crank      xi (mm)  eta (mm)  psi (mrad)     xi (mm)  eta (mm)  psi (mrad)'
    do k = 0, parts
      print '(i7,2(f13.5,f10.5,f12.5))', 360 * k / parts, 1.0e3_dp * turn(:, k, :)
    end do
    do i = 1, 2
      x = converged_motion(four_bar(), crank_speed(speed_rpm(i)), reference_steps, parts)
      call claim(all(abs(turn(:, :, i) - x(:3, :)) < spread(turn_error(:, i), 2, parts + 1) + 1.0e-9_dp), &
        & 'the vibration over a turn')
    end do
  end subroutine show_turn

  subroutine show_orders()
    real(dp) :: last(3)

    print '(/,a)', 'Convergence of (18): largest deviation from the reference relative to its largest element'
    call convergence('the paper''s machine, n = 240', four_bar(), crank_speed(240.0_dp), last)
    call convergence('ten times the link masses, n = 360', heavier(four_bar(), 10.0_dp), crank_speed(360.0_dp), last)
    call claim(abs(last(1) - 2) < 0.1_dp, 'order 2 of (18) as printed')
    call claim(abs(last(2) - 4) < 0.1_dp, 'order 4 of (18) corrected')
    call claim(abs(last(3) - 1) < 0.1_dp, 'order 1 of the initial state with the slip')
  end subroutine show_orders

  !> Errors and observed orders for 360 steps and five doublings; `order` holds those of the last doubling.
  subroutine convergence(title, machine, omega, order)
    character(len=*), intent(in) :: title
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    real(dp), intent(out) :: order(3)

    type(program_options) :: printed, corrected
    real(dp) :: phi(6, 6), x0(6), error(3), coarser(3)
    integer :: i

    phi = converged_monodromy(machine, omega, reference_steps)
    x0 = converged_initial_state(machine, omega, reference_steps)
    print '(/,2x,a)', title, ' steps   Phi as printed order   Phi corrected  order   x0 with slip   order'
    do i = 0, 5
      printed = program_options(steps=360 * 2**i)
      corrected = program_options(steps=360 * 2**i, printed_order=.false.)
      error(1) = maxval(abs(monodromy(machine, omega, printed) - phi)) / maxval(abs(phi))
      error(2) = maxval(abs(monodromy(machine, omega, corrected) - phi)) / maxval(abs(phi))
      error(3) = maxval(abs(initial_state(machine, omega, printed) - x0)) / maxval(abs(x0))
      if (i == 0) then
        print '(i7,3(es14.2,9x))', printed%steps, error
      else
        order = log(coarser / error) / log(2.0_dp)
        print '(i7,3(es14.2,f8.2,1x))', printed%steps, error(1), order(1), error(2), order(2), error(3), order(3)
      end if
      coarser = error
    end do
  end subroutine convergence

end program khang_tables
