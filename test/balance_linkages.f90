!> Linkages for the tests of counterweights, and the shaking forces that they exert.
module balance_linkages
  use checks, only: check_success
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: fourier_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism_shaking, only: shaking, shaking_type
  use gestell_study_balance, only: examine, rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type, with_counterweights
  use testdrive, only: error_type
  implicit none (type, external)
  private

  public :: four_bar, examine_linkage, objective, prepared, shake, skew_four_bar, slider_crank

  real(dp), parameter, public :: speed = 25

contains

  !> The paper's four-bar.
  subroutine four_bar(linkage, error)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable :: failure

    call linkage%ground("A0", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("B0", [0.4_dp, 0.0_dp], failure)
    call linkage%crank("A", "A0", 0.07_dp, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp], 1, failure)
    call linkage%link("crank", "A0", "A", 0.5_dp, 0.0035_dp, [0.03_dp, 0.0_dp], failure)
    call linkage%link("coupler", "A", "B", 0.6_dp, 0.007_dp, [0.18_dp, 0.0_dp], failure)
    call linkage%link("rocker", "B0", "B", 0.25_dp, 0.006_dp, [0.08_dp, 0.0_dp], failure)
    call prepared(linkage, error)
  end subroutine four_bar

  !> The same linkage with all centres of mass off the lines of the joints and with its crank's pivot off the origin.
  subroutine skew_four_bar(linkage, error)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable :: failure

    call linkage%ground("A0", [0.05_dp, -0.02_dp], failure)
    call linkage%ground("B0", [0.4_dp, 0.03_dp], failure)
    call linkage%crank("A", "A0", 0.07_dp, 0.4_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp], 1, failure)
    call linkage%link("crank", "A0", "A", 0.5_dp, 0.0035_dp, [0.03_dp, 0.01_dp], failure)
    call linkage%link("coupler", "A", "B", 0.6_dp, 0.007_dp, [0.18_dp, -0.05_dp], failure)
    call linkage%link("rocker", "B0", "B", 0.25_dp, 0.006_dp, [0.08_dp, 0.03_dp], failure)
    call prepared(linkage, error)
  end subroutine skew_four_bar

  subroutine slider_crank(linkage, error)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 0.05_dp, 0.0_dp, failure)
    call linkage%rrp("B", "A", 0.2_dp, guide_type(point=[0.0_dp, 0.01_dp], angle=0.3_dp), 1, failure)
    call linkage%link("crank", "O", "A", 2.0_dp, 0.002_dp, [0.01_dp, 0.0_dp], failure)
    call linkage%link("rod", "A", "B", 0.6_dp, 0.003_dp, [0.065_dp, 0.02_dp], failure)
    call linkage%link("piston", "B", "", 0.5_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call prepared(linkage, error)
  end subroutine slider_crank

  subroutine prepared(linkage, error)
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable :: failure

    call linkage%prepare(failure)
    call check_success(error, failure, "linkage")
  end subroutine prepared

  !> The bodies of a linkage in axes at its origin, with its crank as seen from the frame.
  subroutine examine_linkage(linkage, rigid, error, about)
    type(linkage_type), intent(in) :: linkage
    type(rigid_ground_type), intent(out) :: rigid
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in), optional :: about(2)
    type(gestell_error), allocatable :: failure
    real(dp) :: point(2)

    point = 0
    if (present(about)) point = about
    call examine(linkage, .false., point, rigid, failure)
    call check_success(error, failure, "bodies")
  end subroutine examine_linkage

  !> The shaking force of a linkage that carries the counterweights as links.
  subroutine shake(linkage, rigid, weights, found, error, uniform_in_space)
    type(linkage_type), intent(in) :: linkage
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    type(shaking_type), intent(out) :: found
    type(error_type), allocatable, intent(inout) :: error
    logical, intent(in), optional :: uniform_in_space
    class(linkage_type), allocatable :: other
    type(gestell_error), allocatable :: failure
    character(len=8) :: names(size(weights))
    integer :: k

    do k = 1, size(weights)
      names(k) = "weight " // achar(iachar("0") + k)
    end do
    call with_counterweights(linkage, rigid%bodies, weights, names, other, failure)
    call check_success(error, failure, "with counterweights")
    if (allocated(error)) return
    call other%prepare(failure)
    call shaking(other, speed, found, failure, uniform_in_space)
    call check_success(error, failure, "shaking forces")
  end subroutine shake

  !> The weighted mean square of force and of the moment about a point, over the fourth power of the speed.
  pure real(dp) function objective(found, weights, about)
    type(shaking_type), intent(in) :: found
    real(dp), intent(in) :: weights(3), about(2)
    complex(dp) :: moment
    integer :: k

    objective = sum(weights(:2)**2 * found%rms(:2)**2)
    associate (fx => found%series(1), fy => found%series(2), m => found%series(3))
      objective = objective + weights(3)**2 * (m%mean - about(1) * fy%mean + about(2) * fx%mean)**2
      do k = 1, size(m%amplitude)
        moment = term(m, k) - about(1) * term(fy, k) + about(2) * term(fx, k)
        objective = objective + weights(3)**2 * abs(moment)**2 / 2
      end do
    end associate
    objective = objective / speed**4
  end function objective

  pure complex(dp) function term(series, k)
    type(fourier_type), intent(in) :: series
    integer, intent(in) :: k

    term = series%amplitude(k) * exp(cmplx(0, series%phase(k), dp))
  end function term

end module balance_linkages
