!> Keys of the input group &boundary.
module gestell_task_boundary_keys
  use gestell_base_key, only: key_type, positive, range_type, real_key, text_key
  use gestell_task_boundary_line, only: max_tolerance, min_tolerance
  implicit none (type, external)
  private

  type(key_type), parameter, public :: boundary_keys(*) = [ &
    & key_type("boundary", "tolerance", real_key, "permitted error relative to the range (of the logarithm with " // &
    &   "`spacing='log'`): of a critical value, or of the distance of a curve from the boundary", &
    &   otherwise="`1e-10` for one parameter, `1e-3` for two", &
    &   range=range_type(min_tolerance, max_tolerance, above_zero=.true.)), &
    & key_type("boundary", "quantity", text_key, "quantity of `&resonance` whose level is sought instead of the stability " // &
    &   "boundary", otherwise="none: stability boundaries"), &
    & key_type("boundary", "measure", text_key, "measure that is compared with `level`, as in `&sweep`", word="peak", &
    &   words="peak, rms, band"), &
    & key_type("boundary", "level", real_key, "level to find, in the SI unit of the quantity; for `'band'` in mm/s", &
    &   otherwise="for `'band'` the `limit_mm_s` of the probe", range=positive)]

end module gestell_task_boundary_keys
