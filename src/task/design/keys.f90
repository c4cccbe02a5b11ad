!> Keys of the input groups &design, &objective, &constraint and &robust.
module gestell_task_design_keys
  use gestell_base_key, only: integer_key, key_type, positive, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Minimum number of points of a curve between two objectives, if it is requested.
  integer, parameter, public :: fewest_of_curve = 3

  type(key_type), parameter, public :: design_keys(*) = [ &
    & key_type("design", "parameter", text_key, "what may be changed: a path as in `--set`, that names a number of the machine"), &
    & key_type("design", "from", real_key, "the least value, in the units of the file"), &
    & key_type("design", "to", real_key, "the greatest value"), &
    & key_type("design", "with", text_key, "paths that take the same value", 1, 1, 20, otherwise="none"), &
    & key_type("design", "starts", integer_key, "points from which a local optimum is sought, the machine of the file first; " // &
    &   "one where the problem is convex; it may stand in any of the groups", default=8.0_dp, &
    &   range=range_type(1.0_dp, 1000.0_dp))]

  type(key_type), parameter, public :: objective_keys(*) = [ &
    & key_type("objective", "quantity", text_key, "what is to be small, see below"), &
    & key_type("objective", "measure", text_key, "what of it, where it changes over the turn, as for `&sweep`", word="rms", &
    &   words="peak, rms, band"), &
    & key_type("objective", "weight", real_key, "its factor, in 1 over its unit", default=1.0_dp, range=positive), &
    & key_type("objective", "combine", text_key, "of several objectives, each times its weight: their sum, or the largest of " // &
    &   "them; it may stand in any of the groups", word="sum", words="sum, largest"), &
    & key_type("objective", "trade_off", integer_key, "points of the curve between two objectives; 0: none; it may stand in " // &
    &   "either group", default=0.0_dp, range=range_type(0.0_dp, 1000.0_dp))]

  type(key_type), parameter, public :: constraint_keys(*) = [ &
    & key_type("constraint", "quantity", text_key, "what is limited, as for `&objective`"), &
    & key_type("constraint", "measure", text_key, "what of it, as for `&objective`", word="rms", words="peak, rms, band"), &
    & key_type("constraint", "at_most", real_key, "its greatest value, in its unit", otherwise="none"), &
    & key_type("constraint", "at_least", real_key, "its least value", otherwise="none"), &
    & key_type("constraint", "equals", real_key, "the value that it is to have", otherwise="none")]

  !> Key of a limit, indexed by its sense (gestell_study_design_goal).
  character(len=8), parameter, public :: limit_keys(-1:1) = [character(len=8) :: "at_least", "equals", "at_most"]

  type(key_type), parameter, public :: robust_keys(*) = [ &
    & key_type("robust", "speed_percent", real_key, "by how much the speed may differ, up and down", default=0.0_dp, symbol="%", &
    &   range=range_type(0.0_dp, 50.0_dp)), &
    & key_type("robust", "mounting_percent", real_key, "by how much the stiffness of the whole mounting may differ", &
    &   default=0.0_dp, symbol="%", range=range_type(0.0_dp, 90.0_dp)), &
    & key_type("robust", "damping_percent", real_key, "by how much its damping may differ", default=0.0_dp, symbol="%", &
    &   range=range_type(0.0_dp, 90.0_dp))]

end module gestell_task_design_keys
