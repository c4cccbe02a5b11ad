!> Tabulates the shaking forces and moments for each order of the crank (balance table), and the unbalance of order 1.
module gestell_task_drawing_balance_table
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: unjudged
  use gestell_math_series_fourier, only: fourier_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: space_shaking_type
  use gestell_model_mechanism_shaking, only: shaking_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_output_table_unit, only: kilogram_metre, newton, newton_metre, radian, unit_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: tabulate_plane, tabulate_space

  !> Highest order of the crank speed in the table
  integer, parameter :: highest = 8
  character(len=*), parameter :: caption = "Forces and moments of the mechanism on a frame at rest; moments are about O."

contains

  !> Tabulates the shaking forces of a frame in the plane, and the unbalance: the vectors of order 1 that rotate with the crank and
  !> against it.
  pure subroutine tabulate_plane(frame, forces, balance, unbalance)
    class(frame_type), intent(in) :: frame
    type(shaking_type), intent(in) :: forces
    type(table_type), intent(out) :: balance, unbalance
    real(dp) :: noise(3), vectors(2), across(2)

    ! Amplitudes below this limit are rounding errors. The limit is relative to the larger of the two forces, and to the terms that
    ! the forces are the sums of.
    noise(:2) = 1.0e-11_dp * max(maxval(forces%series(1)%amplitude), maxval(forces%series(2)%amplitude))
    noise(3) = 1.0e-11_dp * maxval(forces%series(3)%amplitude)
    noise = max(noise, 1.0e-12_dp * frame%speed**2 * frame%mechanism%terms(:3))
    balance = table_of(["fx", "fy", "m "], forces%series, forces%peak(:3), forces%rms(:3), noise, frame%mechanism%turns)
    vectors = abs(forces%unbalance)
    where (.not. vectors * frame%drive_speed()**2 > noise(1)) vectors = 0
    ! Without rounding errors a vector along the negative x-axis has the angle pi, never -pi.
    across = aimag(forces%unbalance)
    where (.not. abs(across) * frame%drive_speed()**2 > noise(1)) across = 0
    unbalance = new_table("unbalance", "Unbalance of order 1", caption, unjudged, shown=.true.)
    call unbalance%add("rotation", "sense of rotation: with the crank or against it", ["with   ", "against"])
    call unbalance%add("unbalance", kilogram_metre, "mass times radius", vectors)
    call unbalance%add("angle", radian, "direction at crank angle 0, from the x-axis", merge(atan2(across, &
      & real(forces%unbalance)), missing(), vectors > 0))
  end subroutine tabulate_plane

  !> Tabulates the shaking forces of a frame in space. The last four columns are the magnitudes of vectors normal to the first shaft
  !> that rotate with the crank or against it.
  pure subroutine tabulate_space(frame, forces, balance)
    class(frame_type), intent(in) :: frame
    type(space_shaking_type), intent(in) :: forces
    type(table_type), intent(out) :: balance
    character(len=*), parameter :: names(4) = [character(len=14) :: "force_with", "force_against", "couple_with", "couple_against"]
    real(dp), allocatable :: values(:)
    integer, allocatable :: orders(:)
    integer :: i

    balance = table_of(["fx", "fy", "fz", "mx", "my", "mz"], forces%series, forces%peak, forces%rms, forces%noise, &
      & frame%mechanism%turns)
    orders = listed_orders(forces%series, forces%noise, frame%mechanism%turns)
    do i = 1, 4
      associate (noise => forces%noise(merge(1, 4, i <= 2)), column => 2 - modulo(i, 2))
        values = forces%couple(orders, column)
        if (i <= 2) values = forces%force(orders, column)
        where (.not. values > noise) values = 0
        call balance%add(trim(names(i)), merge(newton, newton_metre, i <= 2), "magnitude of the vector that rotates " &
          & // trim(merge("with the crank   ", "against the crank", column == 1)), [values, missing(), missing()])
      end associate
    end do
  end subroutine tabulate_space

  !> A balance table, with one row for each order and the rows `peak` and `rms`. Forces below `noise` are 0.
  pure type(table_type) function table_of(names, series, peak, rms, noise, turns) result(table)
    !> Names of the components: f for a force, m for a moment, and the axis
    character(len=2), intent(in) :: names(:)
    type(fourier_type), intent(in) :: series(:)
    real(dp), intent(in) :: peak(:), rms(:), noise(:)
    !> Number of turns of the crank in the period
    integer, intent(in) :: turns
    character(len=8), allocatable :: rows(:)
    real(dp), allocatable :: amplitude(:), phase(:)
    integer, allocatable :: orders(:)
    type(unit_type) :: unit
    integer :: i

    orders = listed_orders(series, noise, turns)
    allocate(rows(size(orders) + 2))
    do i = 1, size(orders)
      rows(i) = order_of(orders(i), turns)
    end do
    rows(size(orders) + 1:) = [character(len=8) :: "peak", "rms"]
    table = new_table("balance_table", "Shaking forces", caption, unjudged, shown=.true.)
    call table%add("component", "order of the crank; then peak and rms over the period", rows)
    do i = 1, size(names)
      unit = merge(newton, newton_metre, names(i)(1:1) == "f")
      amplitude = [series(i)%amplitude(orders), peak(i), rms(i)]
      phase = [series(i)%phase(orders), missing(), missing()]
      where (.not. amplitude > noise(i))
        amplitude = 0
        phase = missing()
      end where
      call table%add(amplitude_of(names(i), unit), unit_type(words=unit%words), "amplitude * cos(order * crank angle + phase)", &
        & amplitude)
      call table%add(trim(names(i)) // "_" // trim(unit%suffix) // "_phase", radian, "phase", phase)
    end do
    call table%mark_details(["phase"])
  end function table_of

  !> Numbers of the harmonics of the period that the table lists: all orders, but fractional orders only if a force is not zero.
  pure function listed_orders(series, noise, turns) result(orders)
    type(fourier_type), intent(in) :: series(:)
    real(dp), intent(in) :: noise(:)
    integer, intent(in) :: turns
    integer, allocatable :: orders(:)
    integer :: i, k

    orders = [(k, k = 1, min(highest * turns, size(series(1)%amplitude)))]
    orders = pack(orders, [(modulo(k, turns) == 0 .or. any([(series(i)%amplitude(k) > noise(i), i = 1, size(series))]), &
      & k = 1, size(orders))])
  end function listed_orders

  !> NaN, which marks a missing value.
  pure real(dp) function missing()

    missing = ieee_value(1.0_dp, ieee_quiet_nan)
  end function missing

end module gestell_task_drawing_balance_table
