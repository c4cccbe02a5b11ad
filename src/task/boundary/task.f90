!> The task `boundary`: finds stability borders in one or two parameters. If the input names a quantity, the task instead finds
!> where the peak, rms or band value of this quantity crosses a level.
module gestell_task_boundary_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either
  use gestell_base_verdict, only: not_judged
  use gestell_input_machine_quantities, only: read_measure
  use gestell_input_namelist_document, only: group_type, groups_named, has, group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: read
  use gestell_output_result, only: result_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_study_measure, only: band_measure, new_measure
  use gestell_study_speed_point, only: speed_options
  use gestell_task_boundary_keys, only: boundary_keys
  use gestell_task_boundary_level_line, only: level_line_type, level_type
  use gestell_task_boundary_level_plane, only: level_kinds, level_plane_type, level_states
  use gestell_task_boundary_level_search, only: find_levels, level_results_type
  use gestell_task_boundary_line, only: border_options, coordinate, most_searched, default_tolerance
  use gestell_task_boundary_line_borders, only: border_accuracy, line_along, usual_deviation
  use gestell_task_boundary_map, only: trace_curves
  use gestell_task_boundary_map_plot, only: over_chart
  use gestell_task_boundary_plot, only: plot_borders
  use gestell_task_boundary_report, only: report_borders, report_search, summary, nearest_words
  use gestell_task_boundary_solution, only: border_results_type, solve_borders
  use gestell_task_boundary_tables, only: border_table, curve_table
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_common_task, only: all_machines, longest_table, task_type
  use gestell_task_range_plan, only: limit_points, refuse_standstill
  implicit none (type, external)
  private

  !> The task `boundary` with its settings from the group &boundary.
  type, extends(task_type), public :: boundary_task
    private
    !> Tolerance of borders, relative to the ranges of the parameters.
    real(dp) :: tolerance = 0
    !> Measured quantity and its level, if crossings of a level are sought; not allocated if stability borders are sought.
    type(level_type), allocatable :: level
  contains
    procedure :: describe, read => read_boundary, preview, run
  end type boundary_task

contains

  pure subroutine describe(self)
    class(boundary_task), intent(inout) :: self

    self%name = "boundary"
    self%meaning = "parameters of `&sweep` at which the machine becomes unstable, or at which a quantity crosses a level"
    self%tables = [character(len=longest_table) :: "boundary", "level"]
    self%scope = all_machines
  end subroutine describe

  !> Reads the group &boundary. Fails if an axis has a single value or includes standstill, if the search would start at too many
  !> points, or if the tolerance is out of range. Fails also if a measure or a level is given without a quantity, or if `read_level`
  !> fails.
  subroutine read_boundary(self, configuration, error)
    class(boundary_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: ranges(:)
    type(group_type) :: group
    integer :: k

    if (.not. self%requested) return
    group = group_named(configuration%document, "boundary")
    ranges = groups_named(configuration%document, "sweep")
    associate (plan => configuration%plan)
      do k = 1, size(ranges)
        if (plan%grid%axes(k)%count > 1) cycle
        call input_error(ranges(k), "count", "must be at least 2 for the task 'boundary'", error)
        return
      end do
      call limit_points(plan%grid, ranges, most_searched, error)
      if (.not. allocated(error)) call refuse_standstill(ranges, plan, error)
      if (.not. allocated(error)) call read(group, boundary_keys, "tolerance", self%tolerance, error, &
        & default=merge(default_tolerance, usual_deviation, size(ranges) == 1))
    end associate
    if (allocated(error)) return
    if (has(group, "quantity")) then
      call read_level(self, group, configuration, error)
    else if (has(group, "measure") .or. has(group, "level")) then
      call input_error(group, either("measure", "level", has(group, "measure")), "requires the key 'quantity', which is missing", &
        & error)
    end if
  end subroutine read_boundary

  !> Reads the quantity, its measure and the level. For a band measure the default level is the limit of the probe, if it has one.
  !> Fails if the quantity does not exist or has no band, or if the level is missing or out of range.
  subroutine read_level(self, group, configuration, error)
    class(boundary_task), intent(inout) :: self
    type(group_type), intent(in) :: group
    type(configuration_type), intent(in) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    character(len=:), allocatable :: name
    type(conversion_type) :: conversion
    integer :: k, kind

    call read_measure(group, boundary_keys, "measure", kind, error)
    if (.not. allocated(error)) call read(group, boundary_keys, "quantity", name, error)
    if (allocated(error)) return
    allocate(self%level)
    associate (measure => self%level%measure)
      call new_measure(configuration%frame, configuration%probes, trim(adjustl(name)), kind, measure, reason)
      if (allocated(reason)) then
        ! If the measure has no name, the quantity does not exist. Otherwise the quantity exists but has no band.
        call input_error(group, trim(merge("quantity", "measure ", measure%quantity == "")), reason%message, error)
        return
      end if
      do k = 1, size(configuration%probes)
        associate (probe => configuration%probes(k))
          if (measure%kind == band_measure .and. index(measure%quantity, "probe(" // trim(probe%name) // ").") == 1) then
            self%level%value = 1000 * probe%limit
          end if
        end associate
      end do
    end associate
    if (has(group, "level") .or. .not. self%level%value > 0) then
      call read(group, boundary_keys, "level", self%level%value, error)
      conversion = configuration%result_units%conversion(self%level%measure%unit)
      self%level%value = conversion%original(self%level%value)
    end if
  end subroutine read_level

  function preview(self, configuration) result(lines)
    class(boundary_task), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = report_search(configuration%plan, self%tolerance, self%level)
  end function preview

  subroutine run(self, context, result, error)
    class(boundary_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(border_results_type) :: results
    integer :: k

    if (allocated(self%level)) then
      call solve_level(self, self%level, context, results, error)
    else
      call solve_stability(self, context, results, error)
    end if
    if (allocated(error)) return
    associate (plan => context%configuration%plan)
      call result%add(border_table(plan, results, self%level), plot_borders(plan, results, self%level))
      if (allocated(results%map)) call result%add_curves("sweep", over_chart(results%map))
      if (allocated(results%curve)) call result%add(curve_table(plan, results%curve%points, self%level))
      call result%warn(not_judged, summary(plan, results, self%level))
      if (allocated(results%nearest)) then
        do k = 1, size(results%nearest)
          call result%warn(not_judged, "Nearest value at which the machine is not unstable: " &
            & // nearest_words(trim(plan%paths(k)), results%nearest(k)))
        end do
      end if
      call result%write_lines(report_search(plan, self%tolerance, self%level) // report_borders(plan, results, self%tolerance, &
        & self%level))
    end associate
  end subroutine run

  !> Finds the stability borders. Fails if the parameters are invalid.
  subroutine solve_stability(self, context, results, error)
    class(boundary_task), intent(in) :: self
    type(context_type), intent(inout), target :: context
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type), target :: family
    type(locked_family_type), allocatable, target :: bare

    associate (plan => context%configuration%plan)
      call context%members(plan%family, family)
      family%accuracy%tolerance = min(family%accuracy%tolerance, border_accuracy)
      if (size(plan%grid%axes) == 1 .and. family%model == "exact") then
        allocate(bare, source=family)
        bare%model = "rest"
      end if
      call solve_borders(family, plan%grid, border_options(context%configuration%accuracy, self%tolerance, context%executor), &
        & plan%base, results, error, bare)
    end associate
  end subroutine solve_stability

  !> If there is one parameter, finds its values at which the level is crossed. If there are two parameters, finds the curves of the
  !> level in their plane. If there is no curve, determines on which side of the level the quantity lies at the centre of the
  !> ranges. Fails if the parameters are invalid.
  subroutine solve_level(self, level, context, results, error)
    class(boundary_task), intent(in) :: self
    type(level_type), intent(in) :: level
    type(context_type), intent(inout), target :: context
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: speed = "drive.speed_rpm"
    type(locked_family_type), target :: family
    type(border_options) :: options
    type(speed_options) :: number
    type(level_plane_type) :: plane
    type(level_line_type) :: line
    type(level_results_type) :: found
    real(dp), allocatable :: nodes(:)
    integer :: k

    options = border_options(context%configuration%accuracy, self%tolerance, context%executor)
    number%names = [level%measure%quantity]
    number%measures = [level%measure]
    number%probes = context%configuration%probes
    number%orders = 0
    number%accuracy = context%configuration%accuracy
    associate (plan => context%configuration%plan)
      call context%members(plan%family, family)
      if (size(plan%grid%axes) == 2) then
        plane%border_options = options
        plane%family => family
        plane%kinds = level_kinds
        plane%states = level_states
        plane%options = number
        plane%level = level%value
        plane%speed_axis = findloc(plan%paths == speed, .true., dim=1)
        allocate(results%map)
        call trace_curves(plane, plan%grid, results%map, error)
        if (.not. allocated(error) .and. results%map%curves == 0) call plane%find_side_at_centre(results%side_at_centre, error)
      else
        associate (axis => plan%grid%axes(1))
          call line_along(family, [axis], 1, [axis%from], options, line%line_type)
          line%options = number
          line%level = level%value
          line%over_speed = plan%paths(1) == speed
          nodes = axis%value([(k, k = 1, axis%count)])
          if (.not. line%over_speed) nodes = 1 + coordinate(axis, nodes)
        end associate
        call find_levels(line, nodes, found, error)
        if (allocated(error)) return
        results%values = found%crossings%border_type
        results%rest%places = found%places%open_border_type
        results%curve = found%curve
        results%curve%points%speed = line%value(results%curve%points%speed)
      end if
    end associate
  end subroutine solve_level

end module gestell_task_boundary_task
