!> Makes `gestell_api_numerics` available under its old name, and its renamed procedures and types under their old names. This
!> module will exist until version 2.0.0.
module gestell_door_numerics
  ! allow(C121)
  use gestell_api_numerics
  use gestell_model_frame, only: weigh_frame => add_gravity
  use gestell_model_frame_in_space, only: planes_of => split_into_planes
  use gestell_model_mounting, only: space_support_type => support_type
  use gestell_study_measure, only: take_measures => compute_measures
  use gestell_study_mechanism_cache, only: remember_mechanism => cache_mechanism
  use gestell_study_point, only: sweep_order_type => sweep_options
  use gestell_study_speed_point, only: speed_order_type => speed_options
  use gestell_study_vibration_analysis, only: tasks_type => analysis_options
  use gestell_study_vibration_statistics, only: take_statistics => compute_statistics
  use gestell_study_vibration_vibration_list, only: several_type => listed_vibration_type
  use gestell_task_campbell, only: campbell_order_type => campbell_options
  use gestell_task_forces_reactions, only: whole_force => force_magnitude
  implicit none (type, external)
  public
end module gestell_door_numerics
