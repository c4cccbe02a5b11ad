!> Defines the keys of the input group &boundary.
module gestell_task_boundary_keys
  use gestell_base_key, only: key_type, positive, range_type, real_key, text_key
  use gestell_task_boundary_line, only: max_tolerance, min_tolerance
  implicit none (type, external)
  private

  type(key_type), parameter, public :: boundary_keys(*) = [ &
    & key_type("boundary", "tolerance", real_key, "permitted error of a critical value, or permitted distance of a curve from " // &
    &   "the boundary; relative to the parameter's range (with `spacing='log'`, to the range of its logarithm)", &
    &   otherwise="`1e-10` for one parameter, `1e-3` for two", range=range_type(min_tolerance, max_tolerance, above_zero=.true.)), &
    & key_type("boundary", "quantity", text_key, "quantity, named as in `&resonance`, whose crossings of `level` are sought " // &
    &   "instead of the stability boundary", otherwise="none: stability boundaries"), &
    & key_type("boundary", "measure", text_key, "which measure of the quantity to compare with `level`; values as in `&sweep " // &
    &   "measures`", word="peak", words="peak, rms, band"), &
    & key_type("boundary", "level", real_key, "value whose crossings are sought, in the unit of the quantity in the " // &
    &   "results: SI units, with `measure='band'` mm/s, or those of `&units results`", &
    &   otherwise="with `measure='band'`, the `limit_mm_s` of the probe", range=positive)]

end module gestell_task_boundary_keys
