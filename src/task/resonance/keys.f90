!> The keys of the group &resonance.
module gestell_task_resonance_keys
  use gestell_base_key, only: integer_key, key_type, range_type, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type(key_type), parameter, public :: resonance_keys(*) = [ &
    & key_type("resonance", "quantities", text_key, "what is looked at, see below", 1, 1, 20, &
    &   otherwise="the free ones of `'xi'`, `'eta'`, `'psi'`, and `'f'`"), &
    & key_type("resonance", "orders", integer_key, "harmonics of the crank that are split off, and orders k of the lines k Omega", &
    &   default=6.0_dp, range=range_type(1.0_dp, 50.0_dp))]

end module gestell_task_resonance_keys
