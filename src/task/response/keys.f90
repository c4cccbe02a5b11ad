!> The keys of the group &response.
module gestell_task_response_keys
  use gestell_base_key, only: integer_key, key_type, range_type, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type(key_type), parameter, public :: response_keys(*) = [ &
    & key_type("response", "points", integer_key, "rows of the time history over one period", default=360.0_dp, &
    &   range=range_type(1.0_dp, 1.0e6_dp)), &
    & key_type("response", "harmonics", integer_key, "harmonics listed", default=20.0_dp, range=range_type(0.0_dp, 8000.0_dp)), &
    & key_type("response", "quantities", text_key, "told in `quantities.csv`, in the report and by `--one-line`, names as for " // &
    &   "`&resonance`", 1, 1, 20, otherwise="none"), &
    & key_type("response", "measures", text_key, "what is told of these quantities, as for `&sweep`", 1, 1, 3, word="peak", &
    &   words="peak, rms, band")]

end module gestell_task_response_keys
