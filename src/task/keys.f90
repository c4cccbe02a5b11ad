!> The groups of an input that say what is asked for and concern several tasks.
module gestell_task_keys
  use gestell_base_key, only: integer_key, joined, key_type, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_floquet_part, only: solution_methods
  use gestell_input_machine_groups, only: machine_schema
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_study_frame_model, only: frame_models
  use gestell_task_boundary_keys, only: boundary_keys
  use gestell_task_resonance_keys, only: resonance_keys
  use gestell_task_response_keys, only: response_keys
  use gestell_task_sweep_keys, only: sweep_keys
  implicit none (type, external)
  private

  public :: accuracy_keys, case_keys_of, schema_of

  type(key_type), parameter, public :: case_keys(*) = [ &
    & key_type("case", "title", text_key, "heads the report and the files", otherwise="none"), &
    & key_type("case", "tasks", text_key, "what is asked for, see below", 1, 1, 20, word="stability, response")]

  type(key_type), parameter, public :: model_keys(*) = [ &
    & key_type("model", "frame", text_key, "the equations that stand for the frame, see below", otherwise="`'exact'`; " // &
    &   "`'rest'` with `coefficients='averaged'`", words=trim(frame_models(1)) // ", " // trim(frame_models(2)) // ", " // &
    &   trim(frame_models(3))), &
    & key_type("model", "vibrations", text_key, "`'all'`: the machine of the file is searched for all its periodic vibrations", &
    &   word="one", words="one, all"), &
    & key_type("model", "coefficients", text_key, "`'averaged'`: M, B, C are replaced by their means over the turn; with " // &
    &   "`frame='rest'` only", word="periodic", words="periodic, averaged")]

  type(key_type), parameter :: fixed_accuracy_keys(*) = [ &
    & key_type("accuracy", "tolerance", real_key, "error allowed to the map over one period, and to the forced solution over " // &
    &   "the period, relative to their size", default=1.0e-9_dp, range=range_type(1.0e-15_dp, 0.1_dp, above_zero=.true.)), &
    & key_type("accuracy", "method", text_key, "how Phi(T) is computed, see below", word="auto"), &
    & key_type("accuracy", "steps", integer_key, "steps per period, of the product Phi(T); 0: as many as the tolerance needs", &
    &   default=0.0_dp, range=range_type(0.0_dp, 1048576.0_dp))]

  type(group_rule), parameter :: case_group = group_rule("case", "title and tasks")
  type(group_rule), parameter :: groups(*) = [ &
    & group_rule("model", "the equations that are solved"), &
    & group_rule("accuracy", "how exactly, and by which method"), &
    & group_rule("response", "for the task `response`: what is written of the vibration"), &
    & group_rule("sweep", "what runs in a line or a grid of machines, one group a parameter", repeatable=.true.), &
    & group_rule("boundary", "for the task `boundary`: borders of stability over the parameters of `&sweep`"), &
    & group_rule("resonance", "for the tasks `resonance`, `critical`, `campbell`: what is looked at over the speeds of `&sweep`")]

contains

  !> The schema of the input file without what is a task's own; these tasks can be ordered.
  function schema_of(tasks) result(schema)
    character(len=*), intent(in) :: tasks(:)
    type(schema_type) :: schema

    schema = machine_schema()
    schema%groups = [case_group, schema%groups, groups]
    schema%keys = [case_keys_of(tasks), schema%keys, model_keys, accuracy_keys(), response_keys, sweep_keys, boundary_keys, &
      & resonance_keys]
  end function schema_of

  !> The keys of the group &case where these tasks can be ordered.
  pure function case_keys_of(tasks) result(keys)
    character(len=*), intent(in) :: tasks(:)
    type(key_type) :: keys(size(case_keys))

    keys = case_keys
    keys(2)%words = joined(tasks)
  end function case_keys_of

  pure function accuracy_keys() result(keys)
    type(key_type) :: keys(size(fixed_accuracy_keys))

    keys = fixed_accuracy_keys
    keys(2)%words = joined(solution_methods())
  end function accuracy_keys

end module gestell_task_keys
