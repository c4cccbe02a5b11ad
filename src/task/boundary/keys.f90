!> The keys of the group &boundary.
module gestell_task_boundary_keys
  use gestell_base_key, only: key_type, range_type, real_key
  use gestell_task_boundary_order, only: greatest_tolerance, least_tolerance
  implicit none (type, external)
  private

  type(key_type), parameter, public :: boundary_keys(*) = [ &
    & key_type("boundary", "tolerance", real_key, "how exactly, relative to the ranges `from` ... `to`, in the logarithm " // &
    &   "where `spacing='log'`: of the critical values, or of the curves' deviation from the border", &
    &   otherwise="`1e-10` for one parameter, `1e-3` for two", &
    &   range=range_type(least_tolerance, greatest_tolerance, above_zero=.true.))]

end module gestell_task_boundary_keys
