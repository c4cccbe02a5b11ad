!> The table of curves in the plane of two parameters.
module gestell_task_boundary_map_table
  use gestell_base_text, only: exact
  use gestell_output_table, only: table_type
  use gestell_output_table_unit, only: radian, unit_type
  use gestell_task_boundary_map, only: border_map_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: add_curves

contains

  !> Adds the columns of boundary.csv, and a remark for each place that the search left open. `kinds`: what kinds there are;
  !> `of_level`: whether these are curves of a level, which have the state of the machine in place of an argument.
  pure subroutine add_curves(plan, map, kinds, table, of_level)
    type(sweep_plan_type), intent(in) :: plan
    type(border_map_type), intent(in) :: map
    character(len=*), intent(in) :: kinds
    type(table_type), intent(inout) :: table
    logical, intent(in) :: of_level
    integer :: i, k

    associate (vertices => map%vertices, places => map%places, paths => plan%paths)
      call table%add("curve", "its number", (vertices%curve))
      do k = 1, 2
        call table%add(trim(paths(k)), unit_type(words=plan%units(k)), "of the vertex, in the units of the input", &
          & [(vertices(i)%parameters(k), i = 1, size(vertices))], error=trim(paths(k)) // "_error")
      end do
      if (.not. of_level) call table%add("arg", radian, "argument of the critical multiplier", (vertices%arg_rad))
      call table%add("kind", kinds, (vertices%kind))
      do k = 1, 2
        call table%add(trim(paths(k)) // "_error", unit_type(words=plan%units(k)), "the same along the line of the search", &
          & [(vertices(i)%error(k), i = 1, size(vertices))])
      end do
      if (of_level) call table%add("state", "of the machine: ok, undamped, undecided or unstable", (vertices%state))
      do i = 1, size(places)
        k = maxloc(places(i)%width, dim=1)
        table%remarks = table%remarks // "open: " // trim(paths(1)) // " = " // exact(places(i)%parameters(1)) // ", " &
          & // trim(paths(2)) // " = " // exact(places(i)%parameters(2)) // " within " // exact(places(i)%width(k)) // " along " &
          & // trim(paths(k)) // ": a border could not be excluded" // new_line("a")
      end do
    end associate
  end subroutine add_curves

end module gestell_task_boundary_map_table
