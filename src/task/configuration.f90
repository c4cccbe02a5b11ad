!> From the groups of an input file to the machine and the orders that they describe.
module gestell_task_configuration
  use gestell_base_error, only: error_type, impossible_mechanism
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_input_namelist_document, only: document_type, group_type, the_group, word_length
  use gestell_input_schema_fingerprint, only: content_of
  use gestell_input_machine_frame, only: read_frame
  use gestell_input_machine_groups, only: read_units
  use gestell_input_schema_read, only: read
  use gestell_input_machine_mechanism, only: read_mechanism
  use gestell_input_namelist_message, only: input_error
  use gestell_input_machine_quantities, only: read_probes, read_quantities
  use gestell_input_schema, only: schema_type
  use gestell_task_keys, only: accuracy_keys, case_keys, input_schema, model_keys
  use gestell_task_resonance_keys, only: resonance_keys
  use gestell_task_response_keys, only: response_keys
  use gestell_task_sensitivity_keys, only: sensitivity_keys
  use gestell_task_sensitivity_plan, only: read_sensitivity, sensitivity_plan_type
  use gestell_task_sweep_plan, only: read_borders, read_sweep, read_speeds, sweep_plan_type
  use gestell_input_schema_units, only: units_type
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: drive_columns, mechanism_type
  use gestell_model_frame_quantity, only: accelerations, guide_forces, probe_type, quantity_type, velocities
  use gestell_study_vibration_analysis, only: tasks_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_configuration

  !> Everything that an input file says.
  type, public :: configuration_type
    character(len=:), allocatable :: title
    type(tasks_type) :: tasks
    !> Whether the trade of speed for accuracy is to be measured.
    logical :: trade = .false.
    type(accuracy_type) :: accuracy
    type(frame_type) :: frame
    !> Whether points of a sweep are to be computed, or borders found among them, and the sweep then.
    logical :: sweep = .false., boundary = .false.
    !> Forces by supports; torque and power of the drive; the mechanism through a turn.
    logical :: forces = .false., power = .false., drawing = .false.
    !> Over the speeds of the sweep: resonance curves, critical speeds, modes.
    logical :: resonance = .false., critical = .false., campbell = .false.
    logical :: sensitivity = .false.
    type(probe_type), allocatable :: probes(:)
    !> What is looked at over the speeds, to how many orders of the crank, and what sensitivity is about.
    type(quantity_type), allocatable :: quantities(:), sensitive(:)
    integer :: orders = 6
    type(sweep_plan_type), allocatable :: plan
    !> What sensitivity is to.
    type(sensitivity_plan_type), allocatable :: sensitivity_plan
    !> The input as it was typed, and its units.
    type(document_type) :: document
    type(units_type) :: units
    !> Hash of all that the input says (`content_of`).
    integer(int64) :: content = 0
    !> Why the machine of the input itself cannot turn, where only others are asked for.
    type(error_type), allocatable :: impossible
  contains
    procedure :: single
    procedure :: over_speed
    procedure :: result_names
  end type configuration_type

contains

  !> The configuration of a checked document; the mechanism has been turned once.
  !> Errors: values out of range, joints that do not fit together (code 2), a mechanism that cannot turn (3).
  subroutine read_configuration(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    class(mechanism_type), allocatable :: mechanism
    type(schema_type) :: schema

    schema = input_schema()
    configuration%document = doc
    configuration%content = content_of(doc, schema)
    call read_orders(doc, configuration, error)
    if (allocated(error)) return
    call read_units(doc, configuration%units, error)
    if (allocated(error)) return
    call read_mechanism(doc, configuration%units, mechanism, error)
    if (allocated(error)) return
    call read_frame(doc, configuration%units, mechanism, configuration%frame, error)
    if (allocated(error)) then
      if (error%code /= impossible_mechanism .or. configuration%single() .or. configuration%over_speed()) return
      call move_alloc(error, configuration%impossible)
    end if
    call read_probes(doc, configuration%units, configuration%probes, error)
    if (.not. allocated(error) .and. .not. allocated(configuration%impossible)) call read_wanted(doc, configuration, error)
    if (allocated(error)) return
    if (configuration%sensitivity) then
      allocate(configuration%sensitivity_plan)
      call read_sensitivity(doc, schema, configuration%units, configuration%sensitivity_plan, error)
      if (allocated(error)) return
    end if
    if (.not. (configuration%sweep .or. configuration%boundary .or. configuration%over_speed())) return
    allocate(configuration%plan)
    call read_sweep(doc, schema, configuration%units, configuration%plan, error)
    configuration%plan%order%accuracy = configuration%accuracy
    configuration%plan%order%averaged = configuration%tasks%averaged
    configuration%plan%order%model = configuration%tasks%model
    if (.not. allocated(error) .and. configuration%over_speed()) call read_speeds(doc, configuration%plan, error)
    if (allocated(error) .or. .not. configuration%boundary) return
    configuration%plan%borders%accuracy = configuration%accuracy
    configuration%plan%borders%averaged = configuration%tasks%averaged
    call read_borders(doc, schema, configuration%plan, error)
  end subroutine read_configuration

  !> Whether anything is asked about the machine of the input itself, and not only about others.
  pure logical function single(self)
    class(configuration_type), intent(in) :: self

    single = self%tasks%stability .or. self%tasks%modes .or. self%tasks%response .or. self%trade .or. self%forces &
      & .or. self%power .or. self%drawing .or. self%sensitivity .or. .not. (self%sweep .or. self%boundary .or. self%over_speed())
  end function single

  !> Whether anything is asked over the speeds of the sweep.
  pure logical function over_speed(self)
    class(configuration_type), intent(in) :: self

    over_speed = self%resonance .or. self%critical .or. self%campbell
  end function over_speed

  !> The names, without ending, of all files that the tasks leave; `vibrates`: the input's own machine has a vibration;
  !> `drawn`: its mechanism is drawn.
  function result_names(self, vibrates, drawn) result(names)
    class(configuration_type), intent(in) :: self
    logical, intent(in) :: vibrates, drawn
    character(len=20), allocatable :: names(:)
    logical :: response, forces, probes

    response = self%tasks%response .and. vibrates
    forces = self%forces .and. vibrates
    probes = response .and. size(self%probes) > 0
    names = [character(len=20) :: &
      & pack(["mechanism"], [drawn]), pack(["multipliers"], [self%tasks%stability .or. self%tasks%modes]), &
      & pack(["modes"], [self%tasks%modes]), pack(["response ", "harmonics"], [response, response]), &
      & pack([character(len=18) :: "supports", "supports_history", "supports_harmonics"], [forces, forces, forces]), &
      & pack([character(len=16) :: "probes", "probes_history", "probes_harmonics"], [probes, probes, probes]), &
      & pack(["power"], [self%power .and. vibrates]), pack(["trade"], [self%trade]), pack(["sweep"], [self%sweep]), &
      & pack(["boundary"], [self%boundary]), pack(["campbell ", "crossings"], [self%campbell, self%campbell]), &
      & pack(["critical"], [self%critical]), pack(["resonance", "peaks    "], [self%resonance, self%resonance]), &
      & pack(["sensitivity"], [self%sensitivity])]
  end function result_names

  !> The quantities that are wanted, and how much of the motion they need. Errors: one that is not there; what the
  !> mechanism does not tell.
  subroutine read_wanted(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: unused(1, drive_columns)
    logical :: known

    associate (frame => configuration%frame, probes => configuration%probes, tasks => configuration%tasks)
      call read_quantities(doc, resonance_keys, frame, probes, .true., configuration%quantities, error)
      if (allocated(error)) return
      call read_quantities(doc, sensitivity_keys, frame, probes, .false., configuration%sensitive, error)
      if (allocated(error)) return
      call read(the_group(doc, "resonance"), resonance_keys, "orders", configuration%orders, error)
      if (allocated(error)) return
      if (configuration%forces) tasks%rows = merge(velocities, guide_forces, size(frame%free) == 3)
      if (size(probes) > 0 .and. tasks%response) tasks%rows = max(tasks%rows, accelerations)
      if (configuration%power) then
        tasks%rows = max(tasks%rows, accelerations)
        call frame%mechanism%tabulate_drive([0.0_dp], unused, known)
        if (.not. known) then
          call input_error(the_group(doc, "mass_functions"), "", "the task 'power' needs the key energy, the harmonics of " &
            & // "sum [m (x'^2 + y'^2) + J phi'^2]", error)
        else if (tasks%averaged) then
          call input_error(the_group(doc, "model"), "coefficients", "the task 'power' needs 'periodic': with averaged " &
            & // "masses power does not balance", error)
        end if
      end if
      if (allocated(error) .or. .not. configuration%drawing) return
      select type (mechanism => frame%mechanism)
      type is (linkage_type)
      class default
        call input_error(the_group(doc, "mass_functions"), "", "there is nothing to draw: the task 'drawing' needs joints and " &
          & // "links", error)
      end select
    end associate
  end subroutine read_wanted

  !> Title, tasks, model and accuracy.
  subroutine read_orders(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=word_length), allocatable :: tasks(:)
    character(len=:), allocatable :: coefficients, model, vibrations

    group = the_group(doc, "case")
    call read(group, case_keys, "title", configuration%title, error)
    if (allocated(error)) return
    call read(group, case_keys, "tasks", tasks, error)
    if (allocated(error)) return
    configuration%tasks%stability = any(tasks == "stability")
    configuration%tasks%modes = any(tasks == "modes")
    configuration%tasks%response = any(tasks == "response")
    configuration%trade = any(tasks == "trade")
    configuration%sweep = any(tasks == "sweep")
    configuration%boundary = any(tasks == "boundary")
    configuration%forces = any(tasks == "forces")
    configuration%power = any(tasks == "power")
    configuration%drawing = any(tasks == "drawing")
    configuration%resonance = any(tasks == "resonance")
    configuration%critical = any(tasks == "critical")
    configuration%campbell = any(tasks == "campbell")
    configuration%sensitivity = any(tasks == "sensitivity")
    configuration%tasks%verdict = configuration%sensitivity

    group = the_group(doc, "response")
    call read(group, response_keys, "points", configuration%tasks%points, error)
    if (.not. allocated(error)) call read(group, response_keys, "harmonics", configuration%tasks%harmonics, error)
    if (allocated(error)) return

    group = the_group(doc, "model")
    call read(group, model_keys, "coefficients", coefficients, error)
    if (allocated(error)) return
    configuration%tasks%averaged = coefficients == "averaged"
    call read(group, model_keys, "frame", model, error, default=trim(merge("rest ", "exact", configuration%tasks%averaged)))
    if (allocated(error)) return
    configuration%tasks%model = model
    if (configuration%tasks%averaged .and. model /= "rest") then
      call input_error(group, "coefficients", "'averaged' is a simplification of frame='rest'", error)
      return
    end if
    call read(group, model_keys, "vibrations", vibrations, error)
    if (allocated(error)) return
    configuration%tasks%all_vibrations = vibrations == "all"
    if (configuration%tasks%all_vibrations .and. model /= "exact") then
      call input_error(group, "vibrations", "linear equations have one vibration: 'all' is for frame='exact'", error)
      return
    end if

    group = the_group(doc, "accuracy")
    associate (accuracy => configuration%accuracy)
      call read(group, accuracy_keys(), "tolerance", accuracy%tolerance, error)
      if (.not. allocated(error)) call read(group, accuracy_keys(), "method", accuracy%method, error)
      if (.not. allocated(error)) call read(group, accuracy_keys(), "steps", accuracy%steps, error)
      if (allocated(error)) return
      if (accuracy%steps > 0 .and. accuracy%method == "reduced") then
        call input_error(group, "steps", "method 'reduced' has no steps", error)
      end if
    end associate
  end subroutine read_orders

end module gestell_task_configuration
