!> Defines the keys of the input groups &design, &objective, &constraint and &robust.
module gestell_task_design_keys
  use gestell_base_key, only: integer_key, key_type, positive, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> If the trade-off curve between two objectives is requested, it must have at least this number of points.
  integer, parameter, public :: min_curve_points = 3

  type(key_type), parameter, public :: design_keys(*) = [ &
    & key_type("design", "parameter", text_key, "number that the design may change, given by its path as in `--set`"), &
    & key_type("design", "from", real_key, "smallest permitted value of the parameter, in the units of the input"), &
    & key_type("design", "to", real_key, "largest permitted value of the parameter, in the units of the input"), &
    & key_type("design", "with", text_key, "paths of further numbers that always get the same value as the parameter", 1, 1, 20, &
    & otherwise="none"), &
    & key_type("design", "starts", integer_key, "number of starting points of the search; the first is the machine in the " // &
    &   "input. A convex problem needs only one. Give this key in only one of the groups `&design`", default=8.0_dp, &
    &   range=range_type(1.0_dp, 1000.0_dp))]

  type(key_type), parameter, public :: objective_keys(*) = [ &
    & key_type("objective", "quantity", text_key, "quantity to minimise: one as in `&resonance`, or `shaking.f`, `torque`, " // &
    &   "`added_mass`, ..."), &
    & key_type("objective", "measure", text_key, "which measure of the quantity to minimise: peak, rms, or rms within the " // &
    &   "frequency band of the probe", word="rms", words="peak, rms, band"), &
    & key_type("objective", "weight", real_key, "factor by which this objective is multiplied; its unit is the reciprocal of " // &
    &   "the objective's unit in the results", default=1.0_dp, range=positive), &
    & key_type("objective", "combine", text_key, "whether the sum or the largest of several weighted objectives is minimised; " // &
    &   "give this key in only one of the groups `&objective`", word="sum", words="sum, largest"), &
    & key_type("objective", "trade_off", integer_key, "number of points on the trade-off curve of two objectives; with `0` no " // &
    &   "curve is computed; give this key in only one of the groups `&objective`", default=0.0_dp, range=range_type(0.0_dp, &
    &   1000.0_dp))]

  type(key_type), parameter, public :: constraint_keys(*) = [ &
    & key_type("constraint", "quantity", text_key, "quantity to which the limit applies; names as in `&objective`"), &
    & key_type("constraint", "measure", text_key, "which measure of the quantity to limit: peak, rms, or rms within the " // &
    &   "frequency band of the probe", word="rms", words="peak, rms, band"), &
    & key_type("constraint", "at_most", real_key, "upper limit of the quantity, in its unit in the results", otherwise="none"), &
    & key_type("constraint", "at_least", real_key, "lower limit", otherwise="none"), &
    & key_type("constraint", "equals", real_key, "required value", otherwise="none")]

  !> Key of the limit for each `sense` of a goal: -1 lower limit, 0 equality, 1 upper limit (gestell_study_design_goal).
  character(len=8), parameter, public :: limit_keys(-1:1) = [character(len=8) :: "at_least", "equals", "at_most"]

  type(key_type), parameter, public :: robust_keys(*) = [ &
    & key_type("robust", "speed_percent", real_key, "tolerance of the speed: its largest deviation upward and downward", &
    &   default=0.0_dp, symbol="%", range=range_type(0.0_dp, 50.0_dp)), &
    & key_type("robust", "mounting_percent", real_key, "tolerance of the stiffness of the whole mounting: its largest " // &
    &   "deviation upward and downward", default=0.0_dp, symbol="%", range=range_type(0.0_dp, 90.0_dp)), &
    & key_type("robust", "damping_percent", real_key, "tolerance of the damping of the whole mounting: its largest deviation " // &
    &   "upward and downward", default=0.0_dp, symbol="%", range=range_type(0.0_dp, 90.0_dp))]

end module gestell_task_design_keys
