!> Reads what an input requests of stability boundaries and of level boundaries: their tolerance.
module gestell_task_boundary_reading
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_namelist_document, only: document_type, group_type, groups_named, the_group
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: read
  use gestell_task_boundary, only: usual_deviation
  use gestell_task_boundary_keys, only: boundary_keys
  use gestell_task_boundary_line_options, only: most_searched, usual_tolerance
  use gestell_task_range_plan, only: limit_points, refuse_standstill, sweep_plan_type
  implicit none (type, external)
  private

  public :: read_tolerance

contains

  !> Tolerance of boundaries relative to the ranges of `plan`. Errors: a range that is a point or goes through standstill; too many
  !> points to search; a tolerance out of bounds.
  subroutine read_tolerance(doc, plan, tolerance, error)
    type(document_type), intent(in) :: doc
    type(sweep_plan_type), intent(in) :: plan
    real(dp), intent(out) :: tolerance
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:)
    integer :: k

    tolerance = 0
    groups = groups_named(doc, "sweep")
    do k = 1, size(groups)
      if (plan%grid%axes(k)%count > 1) cycle
      call input_error(groups(k), "count", "must be at least 2 where a border is sought", error)
      return
    end do
    call limit_points(plan%grid, groups, most_searched, error)
    if (.not. allocated(error)) call refuse_standstill(groups, plan, error)
    if (.not. allocated(error)) call read(the_group(doc, "boundary"), boundary_keys, "tolerance", tolerance, error, &
      & default=merge(usual_tolerance, usual_deviation, size(groups) == 1))
  end subroutine read_tolerance

end module gestell_task_boundary_reading
