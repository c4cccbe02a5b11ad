!> Defines the keys of the input group &sensitivity.
module gestell_task_sensitivity_keys
  use gestell_base_key, only: key_type, text_key
  implicit none (type, external)
  private

  type(key_type), parameter, public :: sensitivity_keys(*) = [ &
    & key_type("sensitivity", "quantities", text_key, "quantities whose peak and rms are differentiated with respect to the " // &
    &   "parameters; names as in `&resonance`", 1, 1, 20, otherwise="`'f'`, and `'probe(NAME).v'` of each probe with a limit"), &
    & key_type("sensitivity", "parameters", text_key, "parameters, given by their paths as in `--set`; if a path names " // &
    &   "several numbers, all change by the same percentage", 1, 1, 40, otherwise="speed, masses, moments of inertia, " // &
    &   "stiffness and damping")]

end module gestell_task_sensitivity_keys
