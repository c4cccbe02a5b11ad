!> Draws the picture of the task `balance`: effect of counterweights on rigid ground and on the mounts.
module gestell_task_balance_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, exact, newline, text
  use gestell_base_words, only: character_count, word_length
  use gestell_output_picture_script, only: figure_type, new_figure, picture_width, tics
  use gestell_output_table, only: table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_task_balance_variants, only: force, moment, variant_type
  implicit none (type, external)
  private

  public :: plot_balance

  !> Height (%) at which bars are cut off. A triangle then marks the bar, and the true value is printed above it
  integer, parameter :: top = 250
  !> If a force or moment of the original machine does not exceed this limit (N, N m), it counts as zero, because percentages of it
  !> would overflow
  real(dp), parameter :: least_original = 100 / huge(1.0_dp)

contains

  !> The picture balance.gp: rms force and moment of every variant, as percentages of the original machine. Each variant has two
  !> bars, one for rigid ground and one for the mounts.
  type(figure_type) function plot_balance(table, variants) result(figure)
    type(table_type), intent(in) :: table
    type(variant_type), intent(in) :: variants(:)
    character(len=:), allocatable :: lines
    character(len=4 * word_length) :: labels(size(variants))
    integer :: i, longest, height

    longest = 0
    do i = 1, size(labels)
      labels(i) = variants(i)%label()
      longest = min(32, max(longest, character_count(trim(labels(i)))))
    end do
    height = 560 + 6 * longest
    lines = "set multiplot layout 2,1 margins 0.14,0.975," // concise((60 + 4.2_dp * longest) / height, 3) // "," &
      & // concise(1 - 60.0_dp / height, 3) // " spacing 0.1," // concise(34.0_dp / height, 3) // " title heading noenhanced" &
      & // newline // "set style data boxes; set boxwidth 0.36" // newline &
      & // "set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "set xrange [-0.6:" // text(size(variants) - 1) // ".6]" // newline &
      & // "cut(v) = v > " // text(top) // " ? " // text(top) // " : v; above(v) = v > " // text(top) // " ? " // text(top) &
      & // " : NaN" // newline &
      & // panel(force, "force", "rigid_f_rms", "f_rms", "set xtics format ''") // "set key off" // newline &
      & // panel(moment, "moment", "rigid_m_rms", "m_rms", "set xtics rotate by 35 right noenhanced (" &
      & // tics(labels, 0) // ")") // "unset multiplot" // newline
    figure = new_figure("balance", "Force and moment with counterweights, on rigid ground and on the mounts", lines, &
      & width=max(picture_width, 160 + 44 * size(variants)), height=height)

  contains

    !> One panel of the picture: bars for two columns of balance.csv, as percentages of the original machine. `rigid`, `mounted`:
    !> names of the columns for rigid ground and for the mounts.
    pure function panel(row, what, rigid, mounted, axis) result(lines)
      integer, intent(in) :: row
      character(len=*), intent(in) :: what, rigid, mounted, axis
      character(len=:), allocatable :: lines
      logical :: clipped

      associate (original => variants(1))
        clipped = 100 * maximum(row) > top
        lines = axis // newline // "set yrange [0:" // text(nint(112 * merge(1.3_dp * top / 100, maximum(row), clipped))) // "]" &
          & // newline // "set ylabel 'rms " // what // " (% of original)'" // newline // "plot " &
          & // bars("'balance.csv'", "-", percent(table, rigid, original%residual%rms(row)), "lt 1 dt 1 lw 1 fs solid 1", &
          & "on rigid ground", clipped) // ", \" // newline // "  " &
          & // bars("''", "+", percent(table, mounted, original%mounted%rms(row)), "lt 2 dt 1 lw 1 fs pattern 2", "on the mounts", &
          & clipped) &
          & // either(", keyentry with points pt 9 ps 1 lc rgb 'black' title 'above " // text(top) // " %'", "", &
          & 100 * max(maximum(force), maximum(moment)) > top) // newline
      end associate
    end function panel

    !> Largest force or moment of all variants, on rigid ground or on the mounts, relative to the original machine; at least 1.
    pure real(dp) function maximum(row)
      integer, intent(in) :: row
      integer :: k

      associate (original => variants(1))
        maximum = 1
        do k = 2, size(variants)
          if (original%residual%rms(row) > least_original) maximum = max(maximum, &
            & variants(k)%residual%rms(row) / original%residual%rms(row))
          if (original%mounted%rms(row) > least_original) maximum = max(maximum, &
            & variants(k)%mounted%rms(row) / original%mounted%rms(row))
        end do
      end associate
    end function maximum

  end function plot_balance

  !> Part of a plot command that draws one bar for each variant, on one `side` ("-" left, "+" right) of the variant's tic mark. If a
  !> bar is cut off, it is marked and its value is printed above it.
  pure function bars(file, side, value, style, title, clipped) result(words)
    character(len=*), intent(in) :: file, side, value, style, title
    !> True if a bar of the panel is cut off. Gnuplot 5.4 crashes if it is to print the labels of a single row that has none
    logical, intent(in) :: clipped
    character(len=:), allocatable :: words

    words = file // " using ($0 " // side // " 0.19):(cut(" // value // ")) " // style // " border lt -1 title '" // title // "'"
    if (clipped) words = words // ", \" // newline // "  '' using ($0 " // side // " 0.19):(above(" // value &
      & // ")):(sprintf('%.0f', " // value // ")) with labels rotate by 90 left font ',11' offset 0,0.9 point pt 9 ps 1 lc rgb " &
      & // "'black' notitle"
  end function bars

  !> Gnuplot expression for a column as a percentage of the value `original` of the original machine; 0 if `original` counts as
  !> zero.
  pure function percent(table, name, original) result(value)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: original
    character(len=:), allocatable :: value
    type(conversion_type) :: conversion

    value = "0"
    associate (column => table%columns(table%number_of(name)))
      conversion = table%units%conversion(either("N", "N m", index(name, "f_rms") > 0))
      if (original > least_original) value = exact(100 / conversion%converted(original))
      value = value // " * column('" // column%key // "')"
    end associate
  end function percent

end module gestell_task_balance_plot
