!> Reads the plan of a design from the input: the parameters, the objectives and the limits.
module gestell_task_design_plan
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type
  use gestell_base_kinds, only: dp
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_input_machine_quantities, only: read_measure
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: count_groups, document_type, group_type, groups_named, has, group_named
  use gestell_input_namelist_message, only: locate_in_group, input_error
  use gestell_input_schema_locate, only: target_type
  use gestell_input_schema_path, only: get_path
  use gestell_input_schema_read, only: read
  use gestell_input_schema_units, only: unit_symbol
  use gestell_input_wording, only: lower, shown
  use gestell_output_table_result_units, only: conversion_type
  use gestell_study_design, only: is_convex
  use gestell_study_design_goal, only: goal_type, new_goal, machine_goal
  use gestell_study_design_perturbed_members, only: along_speed, mass_part, other_part, part_names
  use gestell_study_design_problem, only: design_options
  use gestell_study_measure, only: band_measure, band_only, has_band
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_design_conditions, only: read_conditions
  use gestell_task_design_keys, only: constraint_keys, design_keys, min_curve_points, objective_keys
  use gestell_task_design_limits, only: read_limit, check_contradictions, check_mass_limits
  use gestell_task_design_range, only: range_line_type
  use gestell_task_range_plan, only: find_number, overlap
  implicit none (type, external)
  private

  public :: read_design

  !> Family of machines in which each design parameter may set several numbers of the input.
  type, extends(family_type) :: linked_family_type
    type(document_family_type) :: inner
    !> For each number of the input that the design changes, the index of the design parameter that sets it; shape (numbers). The
    !> numbers are in the order of the parameters of `inner`.
    integer, allocatable :: owner(:)
  contains
    procedure :: member
  end type linked_family_type

  !> Plan of a design: its parameters, goals and operating conditions.
  type, public :: design_plan_type
    !> `paths`: path of each design parameter in the input, for example "frame.mass". `all_paths`: paths of all numbers that the
    !> parameters set (keys `parameter` and `with`).
    character(len=word_length), allocatable :: paths(:), all_paths(:)
    !> For each number of `all_paths`, index of the design parameter that sets it.
    integer, allocatable :: owners(:)
    !> Unit of each design parameter in the input.
    character(len=16), allocatable :: units(:)
    type(linked_family_type) :: family
    type(design_options) :: options
    !> `base`: values of the parameters in the input file. `start`: the same values, moved to the nearest limit if they lie outside
    !> the ranges.
    real(dp), allocatable :: base(:), start(:)
    !> `starts`: number of points at which a local search starts. `curve`: number of points of the trade-off curve between two
    !> objectives; 0 for no curve.
    integer :: starts = 1, curve = 0
    !> Number of turns that the drive makes in a period.
    integer :: turns = 1
    !> `convex`: true if the problem is convex, so that every local optimum is global. `robust`: true if &robust gives a tolerance.
    logical :: convex = .false., robust = .false.
    !> Lines through the range of speeds and tolerances, along which the worst conditions are sought.
    type(range_line_type), allocatable :: lines(:)
  contains
    procedure :: covers
  end type design_plan_type

  integer, parameter :: most_parameters = 40

contains

  !> Creates the machine with the given values of the design `parameters`.
  subroutine member(self, parameters, system, error)
    class(linked_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    call self%inner%member(parameters(self%owner), system, error)
  end subroutine member

  !> True if the worst value of a goal may lie between the given conditions, so that the range between them must be searched.
  pure logical function covers(self)
    class(design_plan_type), intent(in) :: self

    covers = size(self%lines) > 0 .and. (any(self%options%objectives%needs_motion()) &
      & .or. any(self%options%constraints%needs_motion()))
  end function covers

  !> Reads the plan of a design from a checked input document. Fails if &design or &objective is missing, a range is empty, or a
  !> goal does not exist. Fails also if the number at a path cannot be changed, a path occurs twice, a value is invalid, or the
  !> coefficients are averaged.
  subroutine read_design(configuration, plan, error)
    type(configuration_type), intent(inout) :: configuration
    type(design_plan_type), intent(out) :: plan
    type(error_type), allocatable, intent(out) :: error

    if (configuration%analysis%averaged) then
      call input_error(group_named(configuration%document, "model"), "coefficients", "must be 'periodic' for the task " &
        & // "'design'", error)
      return
    end if
    call read_parameters(configuration, plan, error)
    if (.not. allocated(error)) call read_goals(configuration, "objective", objective_keys, plan%options%objectives, error)
    if (.not. allocated(error)) call read_goals(configuration, "constraint", constraint_keys, plan%options%constraints, error)
    if (.not. allocated(error)) call read_shared_keys(configuration%document, plan, error)
    if (.not. allocated(error)) call check_mass_limits(groups_named(configuration%document, "constraint"), &
      & configuration%result_units, plan%options%constraints, &
      & plan%family, plan%start, reshape([plan%options%lower, plan%options%upper], [size(plan%start), 2]), error)
    if (allocated(error)) return
    call read_conditions(configuration, plan%all_paths, plan%options%conditions, plan%lines, plan%robust, error)
    if (allocated(error)) return
    plan%turns = configuration%turns()
    if (size(plan%lines) > 0) then
      associate (line => plan%lines(1))
        if (line%start%along == along_speed .and. abs(line%start%speed) > 0) then
          ! The separation of natural frequencies from orders refers to the whole range of speeds.
          plan%options%constraints%speeds(1) = minval(abs(line%places))
          plan%options%constraints%speeds(2) = maxval(abs(line%places))
        end if
      end associate
    end if
    plan%options%probes = configuration%probes
    plan%options%model = configuration%model()
    plan%options%accuracy = configuration%accuracy
    plan%convex = is_convex(plan%options)
    ! If a mass is zero, its position has no effect, and a search might not move away from there. A single start is therefore
    ! sufficient only if the lower limit of each mass is positive.
    if (plan%convex .and. all(plan%options%lower > 0 .or. plan%options%part /= mass_part)) plan%starts = 1
  end subroutine read_design

  !> Reads the groups &design. Fails if there is no group, if there are too many, or if a path, range or value is invalid.
  subroutine read_parameters(configuration, plan, error)
    type(configuration_type), intent(in) :: configuration
    type(design_plan_type), intent(inout) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:)
    type(target_type), allocatable :: targets(:)
    integer :: i, n

    groups = groups_named(configuration%document, "design")
    n = size(groups)
    if (n == 0) call input_error(group_named(configuration%document, "case"), "tasks", &
      & "the task 'design' needs a group &design with parameter, from and to", error)
    if (n > most_parameters) call input_error(groups(most_parameters + 1), "", &
      & "exceeds the maximum of 40 parameters of a design", error)
    if (allocated(error)) return
    allocate(plan%paths(n), plan%units(n), plan%base(n), plan%start(n), plan%all_paths(0), plan%owners(0), targets(0))
    associate (options => plan%options)
      allocate(options%lower(n), options%upper(n), options%body(n), options%part(n), options%link(n), options%unit(n))
    end associate
    do i = 1, n
      call read_parameter(groups(i))
      if (allocated(error)) return
    end do
    plan%family%owner = plan%owners
    call new_document_family(plan%family%inner, configuration%document, configuration%schema, configuration%units, plan%all_paths, &
      & error, plan%start(plan%owners))
    if (allocated(error)) then
      call locate_in_group(groups(1), error)
    else
      call check_range_ends(groups, plan, error)
    end if

  contains

    !> Reads parameter number i from its group &design.
    subroutine read_parameter(group)
      type(group_type), intent(in) :: group
      character(len=word_length), allocatable :: with(:)
      character(len=:), allocatable :: path
      integer :: closing, k

      call read(group, design_keys, "parameter", path, error)
      if (.not. allocated(error)) call add_path("parameter", trim(adjustl(path)))
      if (allocated(error)) return
      associate (options => plan%options, target => targets(size(targets)), doc => configuration%document, &
        & rules => configuration%schema%keys)
        plan%paths(i) = adjustl(path)
        path = plan%paths(i)
        ! a path such as "link(rod).mass" refers to a property of a link
        closing = index(path, ").")
        options%part(i) = other_part
        if (index(lower(path), "link(") == 1 .and. closing > 0 .and. .not. has(group, "with")) then
          options%part(i) = findloc(part_names == lower(path(closing + 2:)), .true., dim=1)
        end if
        options%body(i) = findloc([(plan%paths(k)(:index(plan%paths(k), ").")) == path(:closing), k = 1, i)], .true., dim=1)
        options%link(i) = 0
        ! If there are several mechanisms, a group may describe several links with different directions of their axes. The link is
        ! then not identified.
        if (options%part(i) /= other_part .and. size(target%groups) > 0 .and. count_groups(doc, "mechanism") == 0) then
          options%link(i) = count([(doc%groups(k)%name == "link", k = 1, target%groups(1))])
        end if
        options%unit(i) = configuration%units%to_si(rules(target%rule), target%element, 1.0_dp)
        plan%units(i) = trim(unit_symbol(rules(target%rule), target%element, configuration%units))
      end associate
      if (has(group, "with")) then
        call read(group, design_keys, "with", with, error)
        do k = 1, size(with)
          if (.not. allocated(error)) call add_path("with", trim(adjustl(with(k))))
        end do
      end if
      if (.not. allocated(error)) call read(group, design_keys, "from", plan%options%lower(i), error)
      if (.not. allocated(error)) call read(group, design_keys, "to", plan%options%upper(i), error)
      if (allocated(error)) return
      if (.not. plan%options%upper(i) > plan%options%lower(i)) then
        call input_error(group, "to", "must be greater than from", error)
        return
      end if
      plan%base(i) = value_in_file(configuration, plan%paths(i))
      plan%start(i) = min(max(plan%base(i), plan%options%lower(i)), plan%options%upper(i))
    end subroutine read_parameter

    !> Adds the path of a number that is set by design parameter number i.
    subroutine add_path(key, name)
      character(len=*), intent(in) :: key, name
      type(target_type) :: target, both(2)
      integer :: j

      call find_number(configuration%document, configuration%schema, groups(i), key, name, target, error)
      do j = 1, size(targets)
        if (allocated(error)) return
        both(1) = targets(j)
        both(2) = target
        if (overlap(configuration%document, both)) call input_error(groups(i), key, shown(name) &
          & // " is already changed by a &design", error)
      end do
      if (allocated(error)) return
      targets = [targets, target]
      plan%all_paths = [character(len=word_length) :: plan%all_paths, name]
      plan%owners = [plan%owners, i]
    end subroutine add_path

  end subroutine read_parameters

  !> Value that the input file gives for the number at `path`, for example "frame.mass"; 0 if the file gives no value.
  real(dp) function value_in_file(configuration, path) result(value)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: path
    type(document_type) :: copy
    type(error_type), allocatable :: none
    real(dp), allocatable :: values(:)

    value = 0
    copy = configuration%document
    call get_path(copy, configuration%schema, trim(path), values, none)
    if (allocated(none)) return
    if (size(values) > 0) value = values(1)
  end function value_in_file

  !> Checks both limits of each range, with the other parameters at their start values. Fails if the input would be invalid with one
  !> of these values.
  subroutine check_range_ends(groups, plan, error)
    type(group_type), intent(in) :: groups(:)
    type(design_plan_type), intent(in) :: plan
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: x(size(groups))
    integer :: i, side

    do i = 1, size(groups)
      do side = 1, 2
        x = plan%start
        x(i) = merge(plan%options%lower(i), plan%options%upper(i), side == 1)
        call plan%family%inner%check(x(plan%owners), error)
        if (.not. allocated(error)) cycle
        call locate_in_group(groups(i), error)
        return
      end do
    end do
  end subroutine check_range_ends

  !> Reads the goals of all groups with the given `name` (`objective` or `constraint`). Fails if there is no objective, or if
  !> `new_goal`, `read_limit` or `check_contradictions` fails.
  subroutine read_goals(configuration, name, keys, goals, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: name
    type(key_type), intent(in) :: keys(:)
    type(goal_type), allocatable, intent(out) :: goals(:)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(group_type), allocatable :: groups(:)
    character(len=:), allocatable :: quantity
    type(conversion_type) :: conversion
    integer :: i, kind

    groups = groups_named(configuration%document, name)
    allocate(goals(size(groups)))
    if (size(groups) == 0 .and. name == "objective") call input_error(group_named(configuration%document, "case"), "tasks", &
      & "the task 'design' needs a group &objective with a quantity", error)
    if (allocated(error)) return
    do i = 1, size(groups)
      call read(groups(i), keys, "quantity", quantity, error)
      if (.not. allocated(error)) call read_measure(groups(i), keys, "measure", kind, error)
      if (allocated(error)) return
      quantity = trim(adjustl(quantity))
      if (kind == band_measure .and. .not. has_band(quantity)) call input_error(groups(i), "measure", band_only, error)
      if (allocated(error)) return
      call new_goal(configuration%frame, configuration%probes, quantity, kind, goals(i), reason)
      if (allocated(reason)) call input_error(groups(i), "quantity", reason%message, error)
      if (allocated(error)) return
      if (goals(i)%about == machine_goal .and. goals(i)%measure%quantity == "added_mass") then
        goals(i)%offset = configuration%frame%mass + configuration%frame%mechanism%mass
      end if
      if (name == "objective") then
        call read(groups(i), keys, "weight", goals(i)%weight, error)
        conversion = configuration%result_units%conversion(goals(i)%measure%unit)
        goals(i)%weight = conversion%converted(goals(i)%weight)
        if (.not. allocated(error) .and. goals(i)%measure%quantity == "separation") call input_error(groups(i), "quantity", &
          & "a separation cannot be minimised: give its lower limit in a &constraint (at_least)", error)
      else
        call read_limit(groups(i), configuration%result_units, goals(i), error)
      end if
      if (allocated(error)) return
    end do
    if (name == "constraint") call check_contradictions(groups, configuration%result_units, goals, error)
  end subroutine read_goals

  !> Reads the keys that may be given in any one of several groups, for example `starts` and `combine`.
  subroutine read_shared_keys(doc, plan, error)
    type(document_type), intent(in) :: doc
    type(design_plan_type), intent(inout) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: designs(:), objectives(:)
    character(len=:), allocatable :: combine
    integer :: i

    designs = groups_named(doc, "design")
    objectives = groups_named(doc, "objective")
    call read(designs(first_with_key(designs, "starts")), design_keys, "starts", plan%starts, error)
    if (.not. allocated(error)) call read(objectives(first_with_key(objectives, "combine")), objective_keys, "combine", combine, &
      & error)
    i = first_with_key(objectives, "trade_off")
    if (.not. allocated(error)) call read(objectives(i), objective_keys, "trade_off", plan%curve, error)
    if (allocated(error)) return
    plan%options%largest = combine == "largest"
    if (plan%curve > 0 .and. size(objectives) /= 2) then
      call input_error(objectives(i), "trade_off", "needs exactly two groups &objective", error)
    else if (plan%curve > 0 .and. plan%curve < min_curve_points) then
      call input_error(objectives(i), "trade_off", "must be 0 or at least 3", error)
    end if
  end subroutine read_shared_keys

  !> Index of the first group that contains the given key; 1 if no group contains it.
  pure integer function first_with_key(groups, key)
    type(group_type), intent(in) :: groups(:)
    character(len=*), intent(in) :: key
    integer :: i

    first_with_key = max(1, findloc([(has(groups(i), key), i = 1, size(groups))], .true., dim=1))
  end function first_with_key

end module gestell_task_design_plan
