!> Defines the keys of the input group &sensitivity.
module gestell_task_sensitivity_keys
  use gestell_base_key, only: key_type, text_key
  implicit none (type, external)
  private

  type(key_type), parameter, public :: sensitivity_keys(*) = [ &
    & key_type("sensitivity", "quantities", text_key, "quantities of `&resonance` whose peak and rms are differentiated", &
    &   1, 1, 20, otherwise="`'f'`, and `'probe(NAME).v'` of probes with a limit"), &
    & key_type("sensitivity", "parameters", text_key, "paths as in `--set`; all numbers that a path names change by the same " // &
    &   "percentage", 1, 1, 40, otherwise="speed, masses, inertias, stiffness and damping")]

end module gestell_task_sensitivity_keys
