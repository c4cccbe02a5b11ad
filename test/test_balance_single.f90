!> The best single counterweights against a closed form, against neighbouring ones, and against a search.
module test_balance_single
  use balance_linkages, only: four_bar, examine_linkage, objective, shake, skew_four_bar, slider_crank, speed
  use checks, only: check_that
  use gestell_base_kinds, only: dp, pi
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism_shaking, only: shaking_type
  use gestell_study_balance, only: residual_shaking_type, measure_residual, rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type
  use gestell_study_balance_single, only: best_single
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_balance_single

  !> Weights of the objective: force, moment, both.
  real(dp), parameter :: weights_of(3, 3) = reshape([1.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.6_dp, 0.6_dp, 4.0_dp], &
    & [3, 3])

contains

  subroutine collect_balance_single(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the crank's best counterweight cancels the forward first harmonic of the force", test_crank), &
      & new_unittest("a counterweight that cancels all shaking is found in every direction", test_directions), &
      & new_unittest("every small change of the best counterweight makes the objective worse", test_optimality), &
      & new_unittest("a grid search finds no better counterweight and one nearly as good", test_search)]
  end subroutine collect_balance_single

  !> F+ is the forward first harmonic of the force; the crank removes its part of the mean square and nothing else. The crank's
  !> counterweight is given relative to the crank, which has the phase 0.4 here.
  subroutine test_crank(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: before, after
    type(counterweight_type) :: best
    type(residual_shaking_type) :: left
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    complex(dp) :: unbalance
    real(dp) :: phase
    integer :: k

    do k = 1, 3
      phase = 0
      if (k == 1) call four_bar(linkage, error)
      if (k == 2) call slider_crank(linkage, error)
      if (k == 3) call skew_four_bar(linkage, error)
      if (k == 3) phase = 0.4_dp
      if (allocated(error)) return
      call examine_linkage(linkage, rigid, error)
      call best_single(rigid, 1, weights_of(:, 1), best)
      call shake(linkage, rigid, [counterweight_type ::], before, error)
      if (allocated(error)) return
      unbalance = best%unbalance * exp(i * (best%angle + phase))
      call check_that(error, abs(unbalance + before%unbalance(1)) / abs(before%unbalance(1)), "<", 1.0e-13_dp, "closed form")
      call shake(linkage, rigid, [best], after, error)
      if (allocated(error)) return
      call check_that(error, abs(after%unbalance(1)) / abs(before%unbalance(1)), "<", 1.0e-13_dp, "no forward first order")
      call check_that(error, abs(after%rms(4)**2 / (before%rms(4)**2 - (speed**2 * abs(before%unbalance(1)))**2) - 1), "<", &
        & 1.0e-11_dp, "mean square")
      call measure_residual(rigid, [best], speed, left)
      call check_that(error, abs(left%rms(1) / after%rms(4) - 1), "<", 1.0e-11_dp, "rms")
    end do
  end subroutine test_crank

  !> The shaking is that of a counterweight opposite to the wanted one. Its direction turns through the circle in half degrees.
  subroutine test_directions(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: unbalance = 0.3_dp
    integer, parameter :: directions = 720
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(counterweight_type) :: best
    real(dp) :: angle
    integer :: b, k

    call skew_four_bar(linkage, error)
    if (allocated(error)) return
    call examine_linkage(linkage, rigid, error)
    do b = 1, size(rigid%bodies)
      do k = 1, directions
        angle = 2 * pi * (k - 0.5_dp) / directions
        associate (effect => rigid%bodies(b)%effect)
          rigid%found = -unbalance * (effect(:, :, 1) + cos(angle) * effect(:, :, 2) + sin(angle) * effect(:, :, 3))
        end associate
        call best_single(rigid, b, weights_of(:, 3), best)
        ! the angle is found to 4e-15; the unbalance loses about half of the digits where the effects are nearly equal
        call check_that(error, abs(best%unbalance * exp(cmplx(0, best%angle - angle, dp)) - unbalance), "<", 1.0e-8_dp, "unbalance")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_directions

  !> For each body and each aim, at about two points: slightly more or less unbalance, or a slightly different place, is worse;
  !> at twice the distance it is four times as much worse.
  subroutine test_optimality(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: found
    type(counterweight_type) :: best, beside
    complex(dp) :: u
    real(dp) :: least, about(2), step, more(2)
    integer :: b, aim, k, n, place

    call skew_four_bar(linkage, error)
    if (allocated(error)) return
    do place = 1, 2
      about = merge([0.0_dp, 0.0_dp], [0.2_dp, -0.15_dp], place == 1)
      call examine_linkage(linkage, rigid, error, about)
      if (allocated(error)) return
      do b = 1, 3
        do aim = 1, 3
          call best_single(rigid, b, weights_of(:, aim), best)
          if (.not. best%unbalance > 0) cycle
          call shake(linkage, rigid, [best], found, error)
          if (allocated(error)) return
          least = objective(found, weights_of(:, aim), about)
          do k = 1, 8
            do n = 1, 2
              step = n * 1.0e-3_dp * best%unbalance
              u = best%unbalance * exp(cmplx(0, best%angle, dp)) + step * exp(cmplx(0, k * pi / 4, dp))
              beside = counterweight_type(b, abs(u), atan2(aimag(u), real(u, dp)))
              call shake(linkage, rigid, [beside], found, error)
              if (allocated(error)) return
              more(n) = objective(found, weights_of(:, aim), about) - least
            end do
            call check_that(error, more(1), ">", 0.0_dp, "neighbouring counterweights are worse")
            call check_that(error, abs(more(2) / more(1) - 4), "<", 0.05_dp, "a minimum: no slope")
          end do
        end do
      end do
    end do
  end subroutine test_optimality

  !> No point of a grid of unbalances and angles is better, and the best of them is nearly as good. If no counterweight helps,
  !> the grid contains none that does.
  subroutine test_search(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: angles = 36, sizes = 24
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: found
    type(counterweight_type) :: best
    real(dp), parameter :: about(2) = [0.2_dp, -0.15_dp]
    real(dp) :: least, as_found, searched, most
    integer :: b, aim, k, n

    call skew_four_bar(linkage, error)
    call examine_linkage(linkage, rigid, error, about)
    call shake(linkage, rigid, [counterweight_type ::], found, error)
    if (allocated(error)) return
    do b = 1, 3
      do aim = 2, 3
        as_found = objective(found, weights_of(:, aim), about)
        call best_single(rigid, b, weights_of(:, aim), best)
        least = as_found
        if (best%unbalance > 0) least = objective_with(best)
        ! the grid extends to three times the optimum
        most = 3 * max(best%unbalance, 0.05_dp)
        searched = as_found
        do k = 0, angles - 1
          do n = 1, sizes
            searched = min(searched, objective_with(counterweight_type(b, most * n / sizes, 2 * pi * k / angles)))
          end do
        end do
        if (allocated(error)) return
        call check_that(error, searched, ">=", least * (1 - 1.0e-10_dp), "no grid point is better")
        call check_that(error, (searched - least) / as_found, "<", 0.02_dp, "one grid point is nearly as good")
      end do
    end do

  contains

    real(dp) function objective_with(weight)
      type(counterweight_type), intent(in) :: weight
      type(shaking_type) :: shaken

      call shake(linkage, rigid, [weight], shaken, error)
      objective_with = huge(objective_with)
      if (.not. allocated(error)) objective_with = objective(shaken, weights_of(:, aim), about)
    end function objective_with

  end subroutine test_search

end module test_balance_single
