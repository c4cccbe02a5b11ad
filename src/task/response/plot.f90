!> Pictures of the periodic vibration: its history over a turn, its harmonics.
module gestell_task_response_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure, axis_unit_type, panel_heading, pick_unit, span
  use gestell_output_report_significance, only: noise_of
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration, only: vibration_type
  use gestell_task_response_names, only: name_type, names_of
  implicit none (type, external)
  private

  public :: plot_harmonics, plot_response, speed_in_words

  character, parameter :: newline = new_line("a")

contains

  !> response.gp: the frame's motion and the forces on the ground over the crank angle.
  function plot_response(frame, vibration) result(figure)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: unit
    real(dp) :: factor, scale
    type(name_type) :: names(3 * frame%dofs())
    integer :: i, k, n

    n = frame%dofs()
    names = names_of(n)
    lines = "set multiplot layout " // text(n) // ",2 margins 0.125,0.975,0.1,0.86 spacing 0.135," &
      & // trim(merge("0.065", "0.04 ", n == 3)) // " title heading noenhanced" // newline &
      & // "set xtics 90; set format x ''" // newline &
      & // "set xrange [0:" // text(nint(sign(360.0_dp, frame%speed)) * frame%mechanism%turns) // "]" // newline
    do i = 1, 2 * n
      ! each coordinate beside the force or moment along it
      k = (i + 1) / 2 + merge(0, 2 * n, mod(i, 2) == 1)
      unit = pick_unit(trim(names(k)%si), vibration%peak(k))
      read (unit%factor, *) factor
      scale = factor * noise_of(vibration%peak(k), vibration%peak_error(k), maxval(vibration%peak(first_of(k, n):first_of(k, n) &
        & + n - 1)))
      if (i == 2 * n - 1) lines = lines // "set format x; set xlabel 'crank angle (deg)'" // newline
      lines = lines // panel_heading("peak " // concise(scale * vibration%peak(k), 4) // ", rms " &
        & // concise(scale * vibration%rms(k), 4) // " " // trim(unit%name)) &
        & // "set ylabel '" // trim(names(k)%symbol) // " (" // trim(unit%name) // ")'" // newline &
        & // "set yrange " // span(factor * vibration%history(k, :), factor * noise(vibration, k, n)) // newline &
        & // "plot 'response.csv' using 'crank_deg':(" // trim(unit%factor) // " * column('" // name_of(names(k)) &
        & // "')) with lines lt " // text(merge(1, 2, mod(i, 2) == 1)) // " dt 1 notitle" // newline
    end do
    figure = new_figure("response", "Periodic vibration and forces on the ground at " // speed_in_words(frame), lines &
      & // "unset multiplot" // newline, width=880, height=220 * n)
  end function plot_response

  !> harmonics.gp: amplitudes over the orders.
  function plot_harmonics(frame, harmonics, vibration) result(figure)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: harmonics
    type(vibration_type), intent(in) :: vibration
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    real(dp) :: step
    integer :: i, n

    n = frame%dofs()
    step = 1.0_dp / frame%mechanism%turns
    lines = "set multiplot layout 2,1 margins 0.11,0.98,0.11,0.79 spacing 0,0.08 title heading noenhanced" // newline &
      & // "set xrange [" // concise(-0.6_dp * step, 6) // ":" // concise((harmonics + 0.6_dp) * step, 6) // "]" // newline &
      & // "set key inside top right horizontal samplen 2" // newline &
      & // "set grid noxtics ytics" // newline &
      & // "set link x2 via x * " // concise(1 / frame%period / step, 9) // " inverse x / " &
      & // concise(1 / frame%period / step, 9) // newline &
      & // "set x2tics; set x2label 'frequency (Hz)'" // newline // "set xtics nomirror; set format x ''" // newline &
      & // "set boxwidth " // concise(0.78_dp / n * step, 3) // newline // "set style fill solid 1 border lt -1" // newline
    do i = 0, 1
      lines = lines // panel(vibration, harmonics, step, n, 2 * n * i)
      if (i == 0) lines = lines // "unset x2label; set format x2 ''; set format x" // newline &
        & // "set xlabel 'order of the crank speed (0: magnitude of the mean)'" // newline
    end do
    figure = new_figure("harmonics", "Harmonics of the vibration and of the forces on the ground at " // speed_in_words(frame), &
      & lines // "unset multiplot" // newline, width=880, height=640)
  end function plot_harmonics

  !> The bars of the quantities of `n` degrees of freedom, those behind `first`, on one logarithmic axis; six decades below the
  !> greatest they end.
  pure function panel(vibration, harmonics, step, n, first) result(lines)
    type(vibration_type), intent(in) :: vibration
    real(dp), intent(in) :: step
    integer, intent(in) :: harmonics, n, first
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: units(n)
    type(name_type) :: names(3 * n)
    real(dp) :: factor, greatest
    integer :: i, k

    greatest = 0
    names = names_of(n)
    do i = 1, n
      k = first + i
      associate (series => vibration%series(k))
        units(i) = pick_unit(trim(names(k)%si), vibration%peak(k))
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
    do i = 1, n
      if (i > 1) lines = lines // ", "
      lines = lines // "'harmonics.csv' using (column('order') + " // concise(0.84_dp / n * step * (i - (n + 1) / 2.0_dp), 3) &
        & // "):(" // trim(units(i)%factor) // " * abs(column('" // name_of(names(first + i)) // "_amplitude'))) with boxes lt " &
        & // text(i) // " dt 1 lw 1 fs " // trim(fills(1 + mod(i - 1, 3))) // " title '" // trim(names(first + i)%symbol) // " (" &
        & // trim(units(i)%name) // ")'"
    end do
    lines = lines // newline
  end function panel

  !> Fills that differ in print without colours.
  pure character(len=24) function fills(i)
    integer, intent(in) :: i
    character(len=24), parameter :: all(3) = [character(len=24) :: "solid 1", "pattern 2", "solid 0.25"]

    fills = all(i)
  end function fills

  !> The first of the `n` quantities of the same kind.
  pure integer function first_of(k, n)
    integer, intent(in) :: k, n

    first_of = n * ((k - 1) / n) + 1
  end function first_of

  !> The column of response.csv.
  pure function name_of(quantity) result(name)
    type(name_type), intent(in) :: quantity
    character(len=:), allocatable :: name
    character(len=5) :: unit

    unit = quantity%si
    if (unit == "N m") unit = "Nm"
    name = trim(quantity%column) // "_" // trim(unit)
  end function name_of

  !> Differences that are nothing but the error of a quantity, or rounding beside its fellows.
  pure real(dp) function noise(vibration, k, n)
    type(vibration_type), intent(in) :: vibration
    integer, intent(in) :: k, n
    integer :: first

    first = first_of(k, n)
    noise = 2 * vibration%peak_error(k)
    if (k < first + 2) noise = max(noise, 1.0e-9_dp * maxval(vibration%peak(first:first + 1)))
  end function noise

  !> The drive's speed.
  pure function speed_in_words(frame) result(words)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: words

    words = concise(frame%drive_rpm(), 6) // " rpm"
  end function speed_in_words

end module gestell_task_response_plot
