!> Builds the four-bar mechanism of the paper in code, without an input file, and prints its verdict and periodic vibration. It uses
!> the paper's equations, linearised about rest; analysis_options() without arguments selects the exact frame.
program four_bar
  use gestell_api_numerics, only: accuracy_type, analyse, analysis_type, damping_matrix, dp, error_type, frame_type, &
    & linkage_type, new_frame, pi, stiffness_matrix, support_type, analysis_options
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)

  type(frame_type) :: frame
  type(analysis_type) :: analysis
  type(error_type), allocatable :: error

  call build(240.0_dp, frame, error)
  if (.not. allocated(error)) call analyse(frame, analysis_options(model="rest"), accuracy_type(), analysis, error)
  if (allocated(error)) then
    write (error_unit, "(a)") error%message
    stop error%code, quiet=.true.
  end if
  call show(analysis)

contains

  !> Builds the machine for a crank speed (1/min).
  subroutine build(speed_rpm, frame, error)
    real(dp), intent(in) :: speed_rpm
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(support_type) :: supports(4)
    real(dp) :: damping(3, 3)
    integer :: i

    call linkage%ground("A0", [0.0_dp, 0.0_dp], error)
    if (allocated(error)) return
    call linkage%ground("B0", [0.40_dp, 0.0_dp], error)
    if (allocated(error)) return
    call linkage%crank("A", pivot="A0", radius=0.07_dp, phase=0.0_dp, error=error)
    if (allocated(error)) return
    call linkage%rrr("B", ends=["A ", "B0"], lengths=[0.37_dp, 0.16_dp], branch=1, error=error)
    if (allocated(error)) return
    call linkage%link("crank", from="A0", to="A", mass=0.50_dp, inertia=0.0035_dp, center=[0.03_dp, 0.0_dp], &
      & error=error)
    if (allocated(error)) return
    call linkage%link("coupler", from="A", to="B", mass=0.60_dp, inertia=0.0070_dp, center=[0.18_dp, 0.0_dp], &
      & error=error)
    if (allocated(error)) return
    call linkage%link("rocker", from="B0", to="B", mass=0.25_dp, inertia=0.0060_dp, center=[0.08_dp, 0.0_dp], &
      & error=error)
    if (allocated(error)) return

    do i = 1, 4
      supports(i) = support_type(position=[-0.5_dp + 0.2_dp * i, -0.20_dp], stiffness=[196133.0_dp, 196133.0_dp])
    end do
    damping = damping_matrix(supports)
    damping(1, 1) = damping(1, 1) + 0.5_dp
    damping(2, 2) = damping(2, 2) + 0.5_dp
    damping(3, 3) = damping(3, 3) + 0.05_dp
    call new_frame(frame, linkage, mass=18.0_dp, inertia=0.78_dp, origin=[-0.20_dp, 0.20_dp], &
      & stiffness=stiffness_matrix(supports), damping=damping, speed=speed_rpm * 2 * pi / 60, error=error)
  end subroutine build

  subroutine show(analysis)
    type(analysis_type), intent(in) :: analysis
    character(len=*), parameter :: names(3) = ["xi ", "eta", "psi"], units(3) = ["mm  ", "mm  ", "mrad"]
    integer :: i

    associate (multipliers => analysis%multipliers, vibration => analysis%vibration)
      print "(2a)", "verdict: ", multipliers%verdict()
      print "(a)", "multipliers |rho|, bound on the error, exponent (1/s, rad/s)"
      do i = 1, size(multipliers%rho)
        print "(2x, f14.12, es9.1, 2f15.7)", abs(multipliers%rho(i)), abs(multipliers%rho(i)) * multipliers%error(i), &
          & multipliers%exponent(i)
      end do
      print "(a)", "periodic vibration: start, peak, bound on the error of the peak"
      do i = 1, 3
        print "(2x, a, 2f14.9, es9.1, 2a)", names(i), 1000 * vibration%start%x0(i), 1000 * vibration%peak(i), &
          & 1000 * vibration%peak_error(i), " ", units(i)
      end do
    end associate
  end subroutine show

end program four_bar
