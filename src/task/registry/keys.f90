!> Defines the input groups that several tasks share, and the schema, which combines them with the groups of the machine.
module gestell_task_registry_keys
  use gestell_input_machine_groups, only: machine_schema
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_task_boundary_keys, only: boundary_keys
  use gestell_task_common_keys, only: accuracy_keys, case_keys_of, model_keys, response_keys
  use gestell_task_common_words, only: shared_words, task_words
  use gestell_task_range_keys, only: resonance_keys, sweep_keys
  implicit none (type, external)
  private

  public :: schema_of

  type(group_rule), parameter :: case_group = group_rule("case", "title and tasks")
  type(group_rule), parameter :: groups(*) = [ &
    & group_rule("model", "which equations of motion to solve"), &
    & group_rule("accuracy", "tolerance and numerical method of the computation"), &
    & group_rule("response", "for the task `response`: number of points and harmonics, and the quantities to report"), &
    & group_rule("sweep", "a parameter to vary; one group gives a line of machines, two groups a grid", repeatable=.true.), &
    & group_rule("boundary", "for the task `boundary`: tolerance of the search; optionally a quantity, whose crossings of a " // &
    &   "level are sought instead of stability boundaries"), &
    & group_rule("resonance", "for the tasks `resonance`, `critical`, `campbell`: quantities and orders over the speeds of " &
    & // "`&sweep`")]

contains

  !> Schema of the input file without those groups that belong to a single task.
  function schema_of(tasks, meanings) result(schema)
    !> Names of the tasks that can be requested, and for each task a sentence that explains what it computes
    character(len=*), intent(in) :: tasks(:), meanings(:)
    type(schema_type) :: schema

    schema = machine_schema()
    schema%groups = [case_group, schema%groups, groups]
    schema%keys = [case_keys_of(tasks), schema%keys, model_keys, accuracy_keys(), response_keys, sweep_keys, boundary_keys, &
      & resonance_keys]
    schema%variants = [task_words(tasks, meanings), schema%variants, shared_words()]
  end function schema_of

end module gestell_task_registry_keys
