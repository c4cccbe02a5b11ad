!> Defines the keys of the input group &separation.
module gestell_task_separation_keys
  use gestell_base_key, only: integer_key, key_type, range_type, real_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type(key_type), parameter, public :: separation_keys(*) = [ &
    & key_type("separation", "orders", integer_key, "highest order of the crank speed that is compared with the natural " // &
    &   "frequencies", default=4.0_dp, range=range_type(1.0_dp, 50.0_dp)), &
    & key_type("separation", "margin_percent", real_key, "required distance of every natural frequency from every order, in " // &
    &   "per cent of the order's frequency", default=20.0_dp, range=range_type(0.0_dp, 1000.0_dp, above_zero=.true.))]

end module gestell_task_separation_keys
