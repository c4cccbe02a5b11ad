!> Keys of the input group &boundary.
module gestell_task_boundary_keys
  use gestell_base_key, only: key_type, positive, range_type, real_key, text_key
  use gestell_task_boundary_line, only: greatest_tolerance, least_tolerance
  implicit none (type, external)
  private

  type(key_type), parameter, public :: boundary_keys(*) = [ &
    & key_type("boundary", "tolerance", real_key, "how exactly, relative to the ranges `from` ... `to`, in the logarithm " // &
    &   "where `spacing='log'`: of the critical values, or of the curves' deviation from the border", &
    &   otherwise="`1e-10` for one parameter, `1e-3` for two", &
    &   range=range_type(least_tolerance, greatest_tolerance, above_zero=.true.)), &
    & key_type("boundary", "quantity", text_key, "whose level is sought in place of stability: a name as for `&resonance`", &
    &   otherwise="none: borders of stability"), &
    & key_type("boundary", "measure", text_key, "what of it comes to the level, as for `&sweep`", word="peak", &
    &   words="peak, rms, band"), &
    & key_type("boundary", "level", real_key, "in the unit of the quantity (m, rad, m/s, rad/s, m/s^2, N, N m), of `'band'` " // &
    &   "in mm/s", otherwise="of `'band'` the probe's `limit_mm_s`", range=positive)]

end module gestell_task_boundary_keys
