!> Keys of the input group &sweep.
module gestell_task_range_keys
  use gestell_base_key, only: integer_key, key_type, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type(key_type), parameter, public :: sweep_keys(*) = [ &
    & key_type("sweep", "parameter", text_key, "what runs: a path as in `--set`, that names a number of the machine, or one " // &
    &   "that all its places take (`support.stiffness`: all supports, both components)"), &
    & key_type("sweep", "from", real_key, "the beginning of the range, in the units of the file"), &
    & key_type("sweep", "to", real_key, "the end of the range", otherwise="`from`, with `count = 1`"), &
    & key_type("sweep", "count", integer_key, "values, both ends among them", range=range_type(least=1.0_dp)), &
    & key_type("sweep", "spacing", text_key, "`'log'`: by a constant factor, the ends of one sign", word="linear", &
    &   words="linear, log"), &
    & key_type("sweep", "engine", text_key, "`'expansion'`: Phi(T) is expanded over cells of the grid and proved at random " // &
    &   "points of them (see doc/theory.md), `'direct'`: every point is solved by itself; `'auto'`: what is quicker; it may " // &
    &   "stand in either group", word="auto", words="auto, expansion, direct"), &
    & key_type("sweep", "columns", text_key, "some of `'rho_max'`, `'log_rho_max'`, `'rho_error'`, `'verdict'`, " // &
    &   "`'xi_peak_m'`, `'eta_peak_m'`, `'psi_peak_rad'`, in space `'zeta_peak_m'`, `'rot_xi_peak_rad'`, " // &
    &   "`'rot_eta_peak_rad'`, and quantities as for `&resonance`, see below; in either group", 1, 1, 30, &
    &   otherwise="all but quantities"), &
    & key_type("sweep", "measures", text_key, "what is told of these quantities: their peak, their root mean square, and of " // &
    &   "velocities of probes that within the probe's band; it may stand in either group", 1, 1, 3, word="peak", &
    &   words="peak, rms, band"), &
    & key_type("sweep", "format", text_key, "`'csv'`: `sweep.csv`; `'npy'`: the same numbers as an array of NumPy in " // &
    &   "`sweep.npy`, see doc/output.md; it may stand in either group", word="csv", words="csv, npy")]

end module gestell_task_range_keys
