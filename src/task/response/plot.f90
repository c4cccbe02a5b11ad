!> Pictures of the periodic vibration: its history over a turn, its harmonics.
module gestell_task_response_plot
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure, axis_unit_type, panel_heading, pick_unit, span
  use gestell_output_report_significance, only: noise_of
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration, only: vibration_type
  implicit none (type, external)
  private

  public :: plot_harmonics, plot_response, speed_in_words

  character, parameter :: newline = new_line("a")

  !> What is shown, as places of gestell_study_vibration: each coordinate beside the force or moment along it.
  integer, parameter :: shown(6) = [1, 7, 2, 8, 3, 9]
  character(len=5), parameter :: columns(6) = [character(len=5) :: "xi", "fx", "eta", "fy", "psi", "m"]
  character(len=9), parameter :: symbols(6) = [character(len=9) :: "ξ", "force x", "η", "force y", "ψ", "moment"]
  character(len=3), parameter :: si(6) = [character(len=3) :: "m", "N", "m", "N", "rad", "N m"]

contains

  !> response.gp: the frame's motion and the forces on the ground over the crank angle.
  function plot_response(frame, vibration) result(figure)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: unit
    real(dp) :: factor, scale
    integer :: i, k

    lines = "set multiplot layout 3,2 margins 0.125,0.975,0.1,0.86 spacing 0.135,0.065 title heading noenhanced" // newline &
      & // "set xtics 90; set format x ''" // newline &
      & // "set xrange [0:" // text(nint(sign(360.0_dp, frame%speed))) // "]" // newline
    do i = 1, size(shown)
      k = shown(i)
      unit = pick_unit(trim(si(i)), vibration%peak(k))
      read (unit%factor, *) factor
      scale = factor * noise_of(vibration%peak(k), vibration%peak_error(k), maxval(vibration%peak(first_of(k):first_of(k) + 2)))
      if (i == size(shown) - 1) lines = lines // "set format x; set xlabel 'crank angle (deg)'" // newline
      lines = lines // panel_heading("peak " // concise(scale * vibration%peak(k), 4) // ", rms " &
        & // concise(scale * vibration%rms(k), 4) // " " // trim(unit%name)) &
        & // "set ylabel '" // trim(symbols(i)) // " (" // trim(unit%name) // ")'" // newline &
        & // "set yrange " // span(factor * vibration%history(k, :), factor * noise(vibration, k)) // newline &
        & // "plot 'response.csv' using 'crank_deg':(" // trim(unit%factor) // " * column('" // name_of(i) &
        & // "')) with lines lt " // text(merge(1, 2, mod(i, 2) == 1)) // " dt 1 notitle" // newline
    end do
    figure = new_figure("response", "Periodic vibration and forces on the ground at " // speed_in_words(frame), lines &
      & // "unset multiplot" // newline, width=880, height=660)
  end function plot_response

  !> harmonics.gp: amplitudes over the orders.
  function plot_harmonics(frame, harmonics, vibration) result(figure)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: harmonics
    type(vibration_type), intent(in) :: vibration
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    integer :: i

    lines = "set multiplot layout 2,1 margins 0.11,0.98,0.11,0.79 spacing 0,0.08 title heading noenhanced" // newline &
      & // "set xrange [-0.6:" // text(harmonics) // ".6]" // newline &
      & // "set key inside top right horizontal samplen 2" // newline &
      & // "set grid noxtics ytics" // newline &
      & // "set link x2 via x * " // concise(1 / frame%period, 9) // " inverse x / " // concise(1 / frame%period, 9) // newline &
      & // "set x2tics; set x2label 'frequency (Hz)'" // newline // "set xtics nomirror; set format x ''" // newline &
      & // "set boxwidth 0.26" // newline // "set style fill solid 1 border lt -1" // newline
    do i = 0, 1
      lines = lines // panel(vibration, harmonics, [1, 3, 5] + i)
      if (i == 0) lines = lines // "unset x2label; set format x2 ''; set format x" // newline &
        & // "set xlabel 'order of the crank speed (0: magnitude of the mean)'" // newline
    end do
    figure = new_figure("harmonics", "Harmonics of the vibration and of the forces on the ground at " // speed_in_words(frame), &
      & lines // "unset multiplot" // newline, width=880, height=640)
  end function plot_harmonics

  !> The bars of three quantities on one logarithmic axis; six decades below the greatest they end.
  pure function panel(vibration, harmonics, three) result(lines)
    type(vibration_type), intent(in) :: vibration
    integer, intent(in) :: harmonics, three(3)
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: units(3)
    real(dp) :: factor, greatest
    integer :: i, k

    greatest = 0
    do i = 1, 3
      k = shown(three(i))
      associate (series => vibration%series(k))
        units(i) = pick_unit(trim(si(three(i))), vibration%peak(k))
        read (units(i)%factor, *) factor
        greatest = max(greatest, factor * abs(series%mean))
        if (harmonics > 0) greatest = max(greatest, factor * maxval(series%amplitude(:harmonics)))
      end associate
    end do
    lines = "set ylabel 'amplitude'" // newline
    if (greatest > 0) then
      lines = lines // "set logscale y" // newline // "set format y '10^{%L}'" // newline &
        & // "set yrange [" // concise(greatest * 1.0e-6_dp, 3) // ":" // concise(greatest * 30, 3) // "]" // newline
    else
      lines = lines // "set yrange [0:1]" // newline
    end if
    lines = lines // "plot "
    do i = 1, 3
      if (i > 1) lines = lines // ", "
      lines = lines // "'harmonics.csv' using (column('order') + " // concise(0.28_dp * (i - 2), 3) // "):(" &
        & // trim(units(i)%factor) // " * abs(column('" // name_of(three(i)) // "_amplitude'))) with boxes lt " // text(i) &
        & // " dt 1 lw 1 fs " // trim(fills(i)) // " title '" // trim(symbols(three(i))) // " (" // trim(units(i)%name) // ")'"
    end do
    lines = lines // newline
  end function panel

  !> Fills that differ in print without colours.
  pure character(len=24) function fills(i)
    integer, intent(in) :: i
    character(len=24), parameter :: all(3) = [character(len=24) :: "solid 1", "pattern 2", "solid 0.25"]

    fills = all(i)
  end function fills

  !> The first of the three quantities of the same kind.
  pure integer function first_of(k)
    integer, intent(in) :: k

    first_of = 3 * ((k - 1) / 3) + 1
  end function first_of

  !> The column of response.csv.
  pure function name_of(i) result(name)
    integer, intent(in) :: i
    character(len=:), allocatable :: name
    character(len=3) :: unit

    unit = si(i)
    if (unit == "N m") unit = "Nm"
    name = trim(columns(i)) // "_" // trim(unit)
  end function name_of

  !> Differences that are nothing but the error of a quantity, or rounding beside its fellows.
  pure real(dp) function noise(vibration, k)
    type(vibration_type), intent(in) :: vibration
    integer, intent(in) :: k
    integer :: first

    first = 3 * ((k - 1) / 3) + 1
    noise = 2 * vibration%peak_error(k)
    if (k < first + 2) noise = max(noise, 1.0e-9_dp * maxval(vibration%peak(first:first + 1)))
  end function noise

  !> The drive's speed.
  pure function speed_in_words(frame) result(words)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: words

    words = concise(frame%speed * 60 / (2 * pi), 6) // " rpm"
  end function speed_in_words

end module gestell_task_response_plot
