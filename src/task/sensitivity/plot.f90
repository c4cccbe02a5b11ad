!> Plots a sensitivity analysis: how much each parameter changes the peaks.
module gestell_task_sensitivity_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_words, only: character_count
  use gestell_math_sorting, only: ascending
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, span, tics
  use gestell_output_table, only: table_type
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_task_sensitivity, only: sensitivity_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_sensitivity

  !> Maximum number of quantities in the plot.
  integer, parameter :: most_quantities = 8

contains

  !> The plot of the table sensitivity.csv. It has one row for each parameter of `paths`, with a point for each quantity.
  type(figure_type) function plot_sensitivity(table, quantities, paths, derivatives) result(figure)
    !> The table sensitivity.csv
    type(table_type), intent(in) :: table
    !> Paths of the parameters, for example "frame.mass"
    character(len=*), intent(in) :: paths(:)
    !> The quantities that were differentiated
    type(quantity_type), intent(in) :: quantities(:)
    !> Derivatives with respect to each parameter, shape (parameters)
    type(sensitivity_type), intent(in) :: derivatives(:)
    character(len=:), allocatable :: lines, assignments
    real(dp) :: aside, changes(size(quantities), size(paths)), effects(size(paths))
    integer :: order(size(paths)), rows(size(paths)), i, n, longest

    n = min(size(quantities), most_quantities)
    do i = 1, size(paths)
      changes(:, i) = derivatives(i)%slope(1, :)
      effects(i) = maxval([0.0_dp, abs(changes(:, i))], mask=ieee_is_finite([0.0_dp, changes(:, i)]))
    end do
    ! Rows are sorted by the largest change. Parameters without effect come last.
    order = ascending(-effects)
    rows(order) = [(i, i = 1, size(paths))]
    longest = maxval([10, (character_count(trim(paths(i))), i = 1, size(paths))])
    assignments = "# the rows, in the order of the table" // newline
    do i = 1, size(paths)
      assignments = assignments // "row[" // text(i) // "] = " // text(rows(i)) // newline
    end do
    lines = "set title heading noenhanced" // newline &
      & // "set xrange " // span([0.0_dp, reshape(changes, [size(changes)])]) // newline &
      & // "set yrange [" // text(size(paths)) // ".6:0.4]" // newline // "set xlabel 'change of the peak (%)'" // newline &
      & // "set ytics noenhanced (" // tics(paths(order), 1) // ")" // newline &
      & // "set lmargin " // text(min(longest + 2, 44)) // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 1" // newline &
      & // "set arrow 1 from first 0,graph 0 to first 0,graph 1 nohead lt 7 dt 1 lw 1" // newline &
      & // "array row[" // text(size(paths)) // "]" // newline // assignments &
      & // "place(i) = row[int(i) + 1]" // newline // "shown(v) = v == v ? v : 1e290" // newline // "plot NaN notitle"
    do i = 1, n
      aside = 0.16_dp * (i - 0.5_dp * (n + 1)) * min(1.0_dp, 5.0_dp / n)
      lines = lines // ", \" // newline // "  'sensitivity.csv' every ::" // text(size(paths) * (i - 1)) // "::" &
        & // text(size(paths) * i - 1) // " using (shown(column(" // text(table%number_of("peak_change_percent_per_percent")) &
        & // "))):(place($0) + " // concise(aside, 3) // ") with points lt " // text(i) // " ps 1.1 title " &
        & // quoted(trim(quantities(i)%name)) // " noenhanced"
    end do
    figure = new_figure("sensitivity", "Change of the peaks if a parameter grows by 1 %", lines, &
      & height=min(180 + 26 * size(paths) + 30 * (n / 6), 1400))
  end function plot_sensitivity

end module gestell_task_sensitivity_plot
