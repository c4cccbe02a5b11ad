!> Defines the keys of the input groups &sweep, and &resonance for the tasks over a range of speeds.
module gestell_task_range_keys
  use gestell_base_key, only: integer_key, key_type, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type(key_type), parameter, public :: sweep_keys(*) = [ &
    & key_type("sweep", "parameter", text_key, "number to vary, given by its path as in `--set`; the path `support.stiffness` " // &
    &   "sets both components of all supports to the same value"), &
    & key_type("sweep", "from", real_key, "first value of the range, in the units of the input"), &
    & key_type("sweep", "to", real_key, "last value of the range", otherwise="`from`, with `count = 1`"), &
    & key_type("sweep", "count", integer_key, "number of values in the range, including both ends", &
    & range=range_type(least=1.0_dp)), &
    & key_type("sweep", "spacing", text_key, "`'linear'` gives equal differences between successive values, `'log'` equal " // &
    &   "ratios; for `'log'` both ends must have the same sign", word="linear", words="linear, log"), &
    & key_type("sweep", "engine", text_key, "`'direct'` solves every point; `'expansion'` interpolates Phi(T) and checks it " // &
    &   "at random points; `'auto'` uses the faster of these methods; give this key in only one of the groups `&sweep`", &
    &   word="auto", words="auto, expansion, direct"), &
    & key_type("sweep", "columns", text_key, "columns: `'rho_max'`, `'log_rho_max'`, `'rho_error'`, `'verdict'`, " // &
    &   "`'xi_peak_m'`, `'eta_peak_m'`, `'psi_peak_rad'`, in space `'zeta_peak_m'`, `'rot_xi_peak_rad'`, " // &
    &   "`'rot_eta_peak_rad'`, and quantities as in `&resonance`; give this key in only one of the groups `&sweep`", 1, 1, 30, &
    &   otherwise="all except quantities"), &
    & key_type("sweep", "measures", text_key, "which values of the quantities in `columns` to write: peak, rms, or the " // &
    &   "rms velocity within the frequency band of the probe; give this key in only one of the groups `&sweep`", 1, 1, 3, &
    &   word="peak", words="peak, rms, band"), &
    & key_type("sweep", "format", text_key, "`'npy'` writes a NumPy array `sweep.npy` instead of `sweep.csv`; give this key " // &
    &   "in only one of the groups `&sweep`", word="csv", words="csv, npy")]

  type(key_type), parameter, public :: resonance_keys(*) = [ &
    & key_type("resonance", "quantities", text_key, "quantities to compute (`xi`, `f`, `probe(NAME).v`, ...)", 1, 1, 20, &
    &   otherwise="the free ones of `'xi'`, `'eta'`, `'psi'`, and `'f'`"), &
    & key_type("resonance", "orders", integer_key, "highest order of the crank speed that the task considers", &
    &   default=6.0_dp, range=range_type(1.0_dp, 50.0_dp))]

end module gestell_task_range_keys
