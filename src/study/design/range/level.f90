!> The scale on which maxima over a range are climbed: beside a resonance a goal goes as P = P_0 / sqrt(1 + u^2), u the distance in
!> half-widths, so of -1 / P^2 the parabola is exact.
module gestell_study_design_range_level
  use gestell_base_kinds, only: dp
  use gestell_study_design_goal, only: goal_type, of_machine, of_multipliers
  implicit none (type, external)
  private

  public :: excess_of, is_inverted, level_of

  !> What a further step of a search may win, relative.
  real(dp), parameter, public :: gain = 1.0e-10_dp

contains

  !> A function of a goal's excess that rises with it, and is nearly a parabola beside a resonance.
  elemental real(dp) function level_of(goal, excess) result(level)
    type(goal_type), intent(in) :: goal
    real(dp), intent(in) :: excess
    real(dp) :: value

    level = excess
    if (.not. is_inverted(goal)) return
    value = excess + goal%limit
    level = -huge(level)
    if (value > 1 / sqrt(huge(value))) level = -1 / value**2
  end function level_of

  !> The excess at a level.
  elemental real(dp) function excess_of(goal, level) result(excess)
    type(goal_type), intent(in) :: goal
    real(dp), intent(in) :: level

    excess = level
    if (is_inverted(goal)) excess = 1 / sqrt(-level) - goal%limit
  end function excess_of

  !> Whether levels are those of 1 / value^2.
  elemental logical function is_inverted(goal)
    type(goal_type), intent(in) :: goal

    is_inverted = goal%sense > 0 .and. all(goal%about /= [of_multipliers, of_machine])
  end function is_inverted

end module gestell_study_design_range_level
