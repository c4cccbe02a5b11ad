!> Composes gnuplot panels with peaks over the crank speed. The scale is that of the motions for which the model holds: peaks beyond
!> small motions are marked at the upper edge of the panel, because their heights are not valid.
module gestell_output_picture_peaks
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_math_sorting, only: ascending
  use gestell_output_picture_axis, only: decade_lines
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, pick_unit
  use gestell_output_picture_marks, only: beyond_colour, none_found
  use gestell_output_picture_script, only: quoted
  use gestell_output_table_result_units, only: result_units_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: peak_panel

  !> Entry of the legend for peaks beyond small motions.
  character(len=*), parameter :: beyond_style = "points pt 9 ps 1.1 lc rgb '#" // beyond_colour // "'"
  character(len=*), parameter, public :: beyond_entry = ", keyentry with " // beyond_style // " title 'beyond small motions'"
  !> Peaks below this fraction of the largest are not drawn
  real(dp), parameter :: least = 1.0e-4_dp
  !> Size of a label, as fractions of the axes
  real(dp), parameter :: label_width = 0.05_dp, label_height = 0.13_dp

  !> A peak in a panel.
  type, public :: peak_type
    !> `speed`: crank speed (1/min). `height`: height in SI units
    real(dp) :: speed = 0, height = 0
    !> True if the model holds for this motion
    logical :: small = .true.
    !> Label of the peak
    character(len=8) :: label = ""
  contains
    procedure :: is_valid
  end type peak_type

contains

  !> True if the height of the peak is valid.
  elemental logical function is_valid(self)
    class(peak_type), intent(in) :: self

    is_valid = self%small .and. self%height > 0 .and. ieee_is_finite(self%height)
  end function is_valid

  !> Gnuplot lines for a panel with the peaks as stems, on a logarithmic scale.
  pure function peak_panel(peaks, range, name, si, units, file, x, y, groups, titles, entries) result(lines)
    type(peak_type), intent(in) :: peaks(:)
    !> Ends of the axis of speeds
    real(dp), intent(in) :: range(2)
    !> `name`: label of the y axis, without the unit. `si`: unit of the heights. `file`: name of the file of the peaks. `x`, `y`:
    !> gnuplot expressions for speed and height in a row. `groups`: conditions for the rows of each group, which has a style of its
    !> own. `titles`: entries of the groups in the legend; blank for no entry. `entries`: further entries of the legend
    character(len=*), intent(in) :: name, si, file, x, y, groups(:), titles(:), entries
    !> Units of the results in the file
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable :: lines, using
    type(growing_text_type) :: curves
    type(axis_unit_type) :: unit
    real(dp) :: low, high
    integer :: i

    high = maxval([0.0_dp, peaks%height], mask=[.true., peaks%is_valid()])
    low = max(least * high, minval([high, peaks%height], mask=[.true., peaks%is_valid()]))
    unit = pick_unit(si, high, units)
    lines = "unset label; set ylabel " // quoted(label_with(name, unit)) // " noenhanced" // newline // "unset logscale y; " &
      & // "set yrange [0:1]; set ytics autofreq; set format y ''; edge = 0.9" // newline
    if (high > 0) lines = lines // "set format y" // newline // decade_lines(concise(0.5_dp * unit%factor * low, 3), &
      & concise(6 * unit%factor * high, 3)) // "edge = top / 1.3" // newline // labels(peaks, range, [0.5_dp * low, 6 * high], &
      & unit%factor)
    if (.not. any(peaks%height > 0)) lines = lines // none_found
    call curves%append("plot NaN notitle")
    do i = 1, merge(size(groups), 0, size(peaks) > 0)
      using = "'" // file // "' using (" // trim(groups(i)) // " && strcol('small_motion') ne '0' ? " // x // " : 1e290):(" &
        & // trim(unit%words) // " * " // y // ")"
      call curves%append(", \" // newline // "  " // using // " with impulses lt " // text(style(i)) // " dt 1 lw 1.5 notitle, " &
        & // using // " with points lt " // text(style(i)) // " ps 1 ")
      if (titles(i) == "") call curves%append("notitle")
      if (titles(i) /= "") call curves%append("title " // quoted(trim(titles(i))) // " noenhanced")
      if (any(.not. peaks%small)) call curves%append(", '' using (" // trim(groups(i)) // " && strcol('small_motion') eq '0' ? " &
        & // x // " : 1e290):(" // y // " > 0 ? edge : NaN) with " // beyond_style // " notitle")
    end do
    lines = lines // curves%whole() // entries // newline
  end function peak_panel

  !> Gnuplot lines with the labels of the peaks. The highest peaks are labelled first; a label that would cover another is omitted.
  pure function labels(peaks, range, ends, factor) result(lines)
    type(peak_type), intent(in) :: peaks(:)
    !> `range`: ends of the axis of speeds. `ends`: ends of the y axis in SI units. `factor`: factor to the unit of the axis
    real(dp), intent(in) :: range(2), ends(2), factor
    character(len=:), allocatable :: lines
    real(dp) :: height(size(peaks)), place(2, size(peaks))
    integer :: order(size(peaks)), i, k, n

    height = 1
    where (peaks%is_valid()) height = (log(max(peaks%height, tiny(1.0_dp))) - log(ends(1))) / (log(ends(2)) - log(ends(1)))
    order = ascending(-height)
    lines = ""
    n = 0
    do k = 1, size(order)
      i = order(k)
      if (.not. peaks(i)%height > 0 .or. height(i) < 0) cycle
      place(:, n + 1) = [peaks(i)%speed / abs(range(2) - range(1)), height(i)]
      if (any(abs(place(1, :n) - place(1, n + 1)) < label_width .and. abs(place(2, :n) - place(2, n + 1)) < label_height)) cycle
      n = n + 1
      lines = lines // "set label " // text(n) // " '" // trim(peaks(i)%label) // "' at first " // concise(peaks(i)%speed, 9)
      if (peaks(i)%is_valid()) then
        lines = lines // ",first " // concise(factor * peaks(i)%height, 6) // " center offset 0,0.8 font ',12'" // newline
      else
        lines = lines // ",graph 1 center offset 0,-1.5 font ',12' textcolor rgb '#666666'" // newline
      end if
    end do
  end function labels

  !> Number of the gnuplot line type for group `i`.
  pure integer function style(i)
    integer, intent(in) :: i

    style = 1 + mod(i - 1, 8)
  end function style

end module gestell_output_picture_peaks
