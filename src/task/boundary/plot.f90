!> Pictures of borders of stability: critical values of one parameter, curves over two.
module gestell_task_boundary_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_picture_axis, only: coordinate, parameter_axis, with_unit
  use gestell_task_boundary_solution, only: border_results_type
  use gestell_study_grid, only: axis_type, grid_type
  implicit none (type, external)
  private

  public :: plot_borders

  character, parameter :: newline = new_line("a")
  character(len=*), parameter :: kinds(3) = [character(len=15) :: "divergence", "period_doubling", "flutter"]
  character(len=*), parameter :: meanings(3) = [character(len=30) :: "divergence (ρ = 1)", "period doubling (ρ = -1)", &
    & "flutter (pair of ρ)"]

contains

  !> boundary.gp, over the parameters `paths`, in these units.
  function plot_borders(paths, units, grid, results) result(figure)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure

    if (allocated(results%map)) then
      figure = plot_map(paths, units, grid, results)
    else
      figure = plot_values(trim(paths(1)), units(1), grid%axes(1), results)
    end if
  end function plot_borders

  !> Critical values with the argument of their multiplier, and which side is unstable.
  function plot_values(path, unit, axis, results) result(figure)
    character(len=*), intent(in) :: path, unit
    type(axis_type), intent(in) :: axis
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, list
    integer :: i

    associate (values => results%values)
      lines = "set title heading noenhanced" // newline // parameter_axis("x", axis, with_unit(path, unit), 0.0_dp) &
        & // "set yrange [-0.08:1.3]" // newline &
        & // "set ylabel '|arg ρ| / π of the critical multiplier'" // newline // "set ytics 0,0.25,1" // newline &
        & // "set key outside bottom center horizontal samplen 2" // newline
      do i = 1, size(values)
        if (values(i)%above == "unstable") lines = lines // band(i, coordinate(axis, values(i)%value), next_of(i))
        if (i == 1 .and. values(i)%below == "unstable") lines = lines // band(0, least(), coordinate(axis, values(i)%value))
        lines = lines // "set label " // text(i) // " '" // concise(values(i)%value, 6) // "' at " &
          & // concise(coordinate(axis, values(i)%value), 9) // "," // concise(values(i)%arg_rad / acos(-1.0_dp) + 0.04_dp, 4) &
          & // " rotate by 90 left font ',12'" // newline
      end do
      list = empty(size(values)) // "plot NaN notitle"
      do i = 1, 3
        if (any(values%kind == kinds(i))) list = list // ", 'boundary.csv' using (strcol('kind') eq '" // trim(kinds(i)) &
          & // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) with impulses lt " // text(i) // " notitle" &
          & // ", '' using (strcol('kind') eq '" // trim(kinds(i)) // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) " &
          & // "with points lt " // text(i) // " ps 1.2 title '" // trim(meanings(i)) // "'"
      end do
      if (size(values) > 0) list = list // ", keyentry with boxes lc rgb '#F3C08F' fs solid 1 title 'unstable'"
    end associate
    figure = new_figure("boundary", "Borders of stability over " // path // ": " // found(size(results%values)), lines // list &
      & // newline, width=800, height=440)
  contains
    !> The critical value behind number `i`, or the end of the range.
    pure real(dp) function next_of(i)
      integer, intent(in) :: i
      real(dp) :: here, others(size(results%values))

      here = coordinate(axis, results%values(i)%value)
      others = coordinate(axis, results%values%value)
      next_of = maxval(coordinate(axis, [axis%from, axis%to]))
      associate (own => others > here .and. results%values%vibration == results%values(i)%vibration)
        if (any(own)) next_of = minval(others, mask=own)
      end associate
    end function next_of

    pure real(dp) function least()
      least = minval(coordinate(axis, [axis%from, axis%to]))
    end function least
  end function plot_values

  !> An unstable interval.
  pure function band(number, from, to) result(line)
    integer, intent(in) :: number
    real(dp), intent(in) :: from, to
    character(len=:), allocatable :: line

    line = "set object " // text(number + 1) // " rectangle from first " // concise(from, 9) // ",graph 0 to first " &
      & // concise(to, 9) // ",graph 1 behind fillcolor rgb '#F9E0C7' fillstyle solid 1 noborder" // newline
  end function band

  !> Curves, their kinds told by dashes, and the unstable side of each.
  function plot_map(paths, units, grid, results) result(figure)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, list
    integer :: i, c

    associate (map => results%map)
      lines = "set title heading noenhanced" // newline &
        & // parameter_axis("x", grid%axes(1), with_unit(paths(1), units(1)), 0.0_dp) &
        & // parameter_axis("y", grid%axes(2), with_unit(paths(2), units(2)), 0.0_dp) &
        & // "set key outside bottom center horizontal samplen 3" // newline
      list = empty(map%curves) // "plot NaN notitle"
      do c = 1, map%curves
        do i = 1, 3
          if (any(map%vertices%curve == c .and. map%vertices%kind == kinds(i))) list = list // ", 'boundary.csv' using " &
            & // "(column(1) == " // text(c) // " && strcol('kind') eq '" // trim(kinds(i)) // "' ? X(column(2)) : NaN):" &
            & // "(Y(column(3))) with lines lt " // text(i) // " lw 2.5 notitle"
        end do
        lines = lines // side(c)
      end do
      do i = 1, 3
        if (any(map%vertices%kind == kinds(i))) list = list // ", keyentry with lines lt " // text(i) // " lw 2.5 title '" &
          & // trim(meanings(i)) // "'"
      end do
    end associate
    figure = new_figure("boundary", "Borders of stability over " // trim(paths(1)) // " and " // trim(paths(2)) // ": " &
      & // found(results%map%curves), lines // list // newline, width=800, height=560)
  contains
    !> A word on the unstable side of a curve's middle, which is on its left.
    function side(c) result(line)
      integer, intent(in) :: c
      character(len=:), allocatable :: line
      real(dp), allocatable :: points(:, :)
      real(dp) :: along(2), low(2), wide(2), at(2)
      integer :: i, k, middle

      line = ""
      allocate(points(2, count(results%map%vertices%curve == c)))
      if (size(points, 2) < 3) return
      do k = 1, 2
        points(k, :) = pack(coordinate(grid%axes(k), results%map%vertices%parameters(k)), results%map%vertices%curve == c)
        low(k) = minval(coordinate(grid%axes(k), [grid%axes(k)%from, grid%axes(k)%to]))
        wide(k) = maxval(coordinate(grid%axes(k), [grid%axes(k)%from, grid%axes(k)%to])) - low(k)
        points(k, :) = (points(k, :) - low(k)) / wide(k)
      end do
      ! where there is room for a word: the farthest from the rim
      middle = 2
      do i = 2, size(points, 2) - 1
        if (room(points(:, i)) > room(points(:, middle))) middle = i
      end do
      along = points(:, middle + 1) - points(:, middle - 1)
      if (.not. norm2(along) > 0) return
      at = points(:, middle) + 0.05_dp * [-along(2), along(1)] / norm2(along)
      at = low + wide * at
      line = "set label " // text(c) // " 'unstable' at " // concise(at(1), 7) // "," // concise(at(2), 7) &
        & // " center font ',12' textcolor rgb '#444444'" // newline
    end function side

    pure real(dp) function room(point)
      real(dp), intent(in) :: point(2)

      room = minval([point, 1 - point])
    end function room
  end function plot_map

  !> What an empty picture says.
  pure function empty(number) result(line)
    integer, intent(in) :: number
    character(len=:), allocatable :: line

    line = ""
    if (number == 0) line = "set label 1 'none found' at graph 0.5,graph 0.5 center textcolor rgb '#444444'" // newline
  end function empty

  pure function found(number) result(words)
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = text(number) // " found"
    if (number == 0) words = "none found"
  end function found

end module gestell_task_boundary_plot
