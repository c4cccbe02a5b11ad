!> Reads the machine, and the settings shared by all tasks, from the groups of an input file.
module gestell_task_common_configuration
  use gestell_base_error, only: error_type, impossible_mechanism
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_input_namelist_document, only: document_type, group_type, group_named
  use gestell_input_machine_frame, only: read_frame
  use gestell_input_machine_groups, only: read_units
  use gestell_input_schema_read, only: read
  use gestell_input_machine_mechanism, only: read_mechanism
  use gestell_input_namelist_message, only: input_error
  use gestell_input_machine_quantities, only: read_probes
  use gestell_input_schema, only: schema_type
  use gestell_task_range_plan, only: read_sweep, read_speeds, sweep_plan_type
  use gestell_input_schema_units, only: units_type
  use gestell_task_common_keys, only: accuracy_keys, case_keys, model_keys, response_keys
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism, only: mechanism_type
  use gestell_output_table_result_units, only: result_units_type
  use gestell_model_quantity_rows, only: guide_forces, probe_type, velocities
  use gestell_study_vibration_analysis, only: analysis_options
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_machine, read_plan

  !> The machine of an input file, and the settings shared by all tasks.
  type, public :: configuration_type
    character(len=:), allocatable :: title
    !> Which results are computed for the machine of the input, because a task needs them.
    type(analysis_options) :: analysis
    type(accuracy_type) :: accuracy
    type(frame_type) :: frame
    type(probe_type), allocatable :: probes(:)
    !> The sweep; not allocated if the input varies no parameter.
    type(sweep_plan_type), allocatable :: plan
    !> The input as the user typed it.
    type(document_type) :: document
    !> Groups and keys that are allowed in the input.
    type(schema_type) :: schema
    !> Units of the numbers in the input.
    type(units_type) :: units
    !> Units of the results.
    type(result_units_type) :: result_units
    !> Hash of the complete input, computed by `content_hash`.
    integer(int64) :: content = 0
    !> The reason why the machine of the input cannot turn. Stored only if no task needs this machine; otherwise
    !> `read_machine` fails with this error.
    type(error_type), allocatable :: impossible
  contains
    procedure :: model, speeds, harmonics, turns, force_rows, request_forces
  end type configuration_type

contains

  !> Reads the machine of a checked input document, and evaluates its mechanism over one period. `own`: true if a task needs this
  !> machine. Otherwise a mechanism that cannot turn is not an error. Fails if a value is out of range, if joints do not fit
  !> together (code 2), or if a mechanism that is needed cannot turn (code 3).
  subroutine read_machine(configuration, own, error)
    type(configuration_type), intent(inout) :: configuration
    logical, intent(in) :: own
    type(error_type), allocatable, intent(out) :: error
    class(mechanism_type), allocatable :: mechanism

    call read_model(configuration, error)
    if (allocated(error)) return
    associate (doc => configuration%document, units => configuration%units, frame => configuration%frame)
      call read_units(doc, units, error, configuration%result_units%units)
      if (.not. (allocated(error) .or. configuration%result_units%are_si())) call collect_names(doc, &
        & configuration%result_units%names)
      if (.not. allocated(error)) call read_mechanism(doc, units, mechanism, error)
      if (allocated(error)) return
      call read_frame(doc, units, mechanism, frame, error)
      if (allocated(error)) then
        if (error%code /= impossible_mechanism .or. own) return
        call move_alloc(error, configuration%impossible)
        ! With this the quantities of a machine can be listed even if its mechanism is impossible.
        if (.not. allocated(frame%free)) frame%free = [1, 2, 3]
      end if
      call read_probes(doc, units, configuration%probes, error)
    end associate
  end subroutine read_machine

  !> Collects the texts of the input that contain digits, each after a newline.
  pure subroutine collect_names(doc, names)
    type(document_type), intent(in) :: doc
    character(len=:), allocatable, intent(out) :: names
    integer :: g, i, k

    names = ""
    do g = 1, size(doc%groups)
      do i = 1, size(doc%groups(g)%entries)
        associate (values => doc%groups(g)%entries(i)%values)
          do k = 1, size(values)
            if (values(k)%quoted .and. scan(values(k)%text, "0123456789") > 0) names = names // newline // values(k)%text
          end do
        end associate
      end do
    end do
  end subroutine collect_names

  !> Reads the sweep. `over_speed`: true if the sweep must vary the speed. Fails if `read_sweep` or `read_speeds` fails.
  subroutine read_plan(configuration, over_speed, error)
    type(configuration_type), intent(inout) :: configuration
    logical, intent(in) :: over_speed
    type(error_type), allocatable, intent(out) :: error

    allocate(configuration%plan)
    associate (plan => configuration%plan, doc => configuration%document)
      call read_sweep(doc, configuration%schema, configuration%units, configuration%frame, configuration%probes, plan, error)
      plan%options%accuracy = configuration%accuracy
      plan%options%model = configuration%model()
      plan%result_units = configuration%result_units
      if (.not. allocated(error) .and. over_speed) call read_speeds(doc, plan, error)
    end associate
  end subroutine read_plan

  !> Name of the frame's model in reports.
  pure character(len=11) function model(self) result(name)
    class(configuration_type), intent(in) :: self

    name = self%analysis%model
    if (self%analysis%averaged) name = "averaged"
  end function model

  !> Speeds of the sweep (1/min), which are the values of its first axis.
  pure function speeds(self)
    class(configuration_type), intent(in) :: self
    real(dp), allocatable :: speeds(:)
    integer :: k

    associate (axis => self%plan%grid%axes(1))
      speeds = axis%value([(k, k = 1, axis%count)])
    end associate
  end function speeds

  !> Number of turns that the drive makes in a period.
  pure integer function turns(self)
    class(configuration_type), intent(in) :: self

    turns = 1
    if (allocated(self%frame%mechanism)) turns = self%frame%mechanism%turns
  end function turns

  !> Numbers of the harmonics of the period up to `highest` times the drive speed that the tasks consider.
  pure function harmonics(self, highest)
    class(configuration_type), intent(in) :: self
    integer, intent(in) :: highest
    integer, allocatable :: harmonics(:)
    integer :: k

    if (allocated(self%frame%mechanism)) then
      harmonics = self%frame%mechanism%harmonics(highest)
    else
      harmonics = [(k, k = 1, highest)]
    end if
  end function harmonics

  !> Reads the title, the model, the accuracy, and the results that are needed for the machine of the input.
  subroutine read_model(configuration, error)
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=:), allocatable :: coefficients, model, vibrations

    associate (doc => configuration%document, analysis => configuration%analysis, accuracy => configuration%accuracy)
      analysis%stability = .false.
      analysis%response = .false.
      call read(group_named(doc, "case"), case_keys, "title", configuration%title, error)
      group = group_named(doc, "response")
      if (.not. allocated(error)) call read(group, response_keys, "points", analysis%points, error)
      if (.not. allocated(error)) call read(group, response_keys, "harmonics", analysis%harmonics, error)

      group = group_named(doc, "model")
      if (.not. allocated(error)) call read(group, model_keys, "coefficients", coefficients, error)
      if (allocated(error)) return
      analysis%averaged = coefficients == "averaged"
      call read(group, model_keys, "frame", model, error, default=trim(merge("rest ", "exact", analysis%averaged)))
      if (.not. allocated(error)) call read(group, model_keys, "vibrations", vibrations, error)
      if (allocated(error)) return
      analysis%model = model
      analysis%all_vibrations = vibrations == "all"
      if (analysis%averaged .and. model /= "rest") then
        call input_error(group, "coefficients", "'averaged' requires frame='rest', but frame='" // model // "'", error)
      else if (analysis%all_vibrations .and. model /= "exact") then
        call input_error(group, "vibrations", "'all' requires frame='exact': with frame='" // model &
          & // "' there is only one vibration", error)
      end if

      group = group_named(doc, "accuracy")
      if (.not. allocated(error)) call read(group, accuracy_keys(), "tolerance", accuracy%tolerance, error)
      if (.not. allocated(error)) call read(group, accuracy_keys(), "method", accuracy%method, error)
      if (.not. allocated(error)) call read(group, accuracy_keys(), "steps", accuracy%steps, error)
      if (allocated(error)) return
      if (accuracy%steps > 0 .and. accuracy%method == "reduced") then
        call input_error(group, "steps", "must be 0, because method='reduced' does not integrate in steps", error)
      end if
    end associate
  end subroutine read_model

  !> Rows of the motion from which all forces on the ground, including those of guides, are computed.
  pure integer function force_rows(self)
    class(configuration_type), intent(in) :: self

    force_rows = merge(velocities, guide_forces, size(self%frame%free) == self%frame%dofs())
  end function force_rows

  !> Requests the rows of the motion for the forces on the ground, because the HTML page reports these forces. Does nothing if no
  !> vibration is computed.
  pure subroutine request_forces(self)
    class(configuration_type), intent(inout) :: self

    if (allocated(self%impossible) .or. .not. self%analysis%vibration()) return
    self%analysis%rows = max(self%analysis%rows, self%force_rows())
  end subroutine request_forces

end module gestell_task_common_configuration
