!> Defines the keys of those input groups that several tasks use: &case, &model, &accuracy, &response.
module gestell_task_common_keys
  use gestell_base_key, only: integer_key, joined, key_type, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_floquet_solution_part, only: solution_methods
  use gestell_study_frame_model, only: frame_models
  implicit none (type, external)
  private

  public :: accuracy_keys, case_keys_of

  type(key_type), parameter, public :: case_keys(*) = [ &
    & key_type("case", "title", text_key, "title, printed in the report and in the result files", otherwise="none"), &
    & key_type("case", "tasks", text_key, "tasks to compute", 1, 1, 20, word="stability, response")]

  type(key_type), parameter, public :: model_keys(*) = [ &
    & key_type("model", "frame", text_key, "which equations of motion of the frame to solve", otherwise="`'exact'`; " // &
    &   "`'rest'` with `coefficients='averaged'`", words=trim(frame_models(1)) // ", " // trim(frame_models(2)) // ", " // &
    &   trim(frame_models(3))), &
    & key_type("model", "vibrations", text_key, "whether to search for one periodic vibration of the machine or for all of them", &
    &   word="one", words="one, all"), &
    & key_type("model", "coefficients", text_key, "`'averaged'` replaces the matrices M, B and C (mass, damping, stiffness) " // &
    &   "by their means over the period; allowed only with `frame='rest'`", word="periodic", words="periodic, averaged")]

  type(key_type), parameter :: fixed_accuracy_keys(*) = [ &
    & key_type("accuracy", "tolerance", real_key, "permitted relative error of Phi(T), the state transition matrix over one " // &
    &   "period, and of the forced motion over the period", default=1.0e-9_dp, &
    &   range=range_type(1.0e-15_dp, 0.1_dp, above_zero=.true.)), &
    & key_type("accuracy", "method", text_key, "method that computes Phi(T)", word="auto"), &
    & key_type("accuracy", "steps", integer_key, "number of integration steps per period; with `0` the program takes as many " // &
    &   "as the tolerance requires", default=0.0_dp, range=range_type(0.0_dp, 1048576.0_dp))]

  type(key_type), parameter, public :: response_keys(*) = [ &
    & key_type("response", "points", integer_key, "number of equal intervals of the time history over one period", &
    &   default=360.0_dp, range=range_type(1.0_dp, 1.0e6_dp)), &
    & key_type("response", "harmonics", integer_key, "highest order of the crank speed in the tables of harmonics", &
    &   default=20.0_dp, range=range_type(0.0_dp, 8000.0_dp)), &
    & key_type("response", "quantities", text_key, "quantities to report and to write to `quantities.csv` and to the line of " // &
    &   "`--one-line`; names as in `&resonance`", 1, 1, 20, otherwise="none"), &
    & key_type("response", "measures", text_key, "which values of the `quantities` to report: peak, rms, or the rms velocity " // &
    &   "within the frequency band of the probe", 1, 1, 3, word="peak", words="peak, rms, band")]

contains

  !> Keys of the group &case. Its key `tasks` accepts the names in `tasks`.
  pure function case_keys_of(tasks) result(keys)
    character(len=*), intent(in) :: tasks(:)
    type(key_type) :: keys(size(case_keys))

    keys = case_keys
    keys(2)%words = joined(tasks)
  end function case_keys_of

  pure function accuracy_keys() result(keys)
    type(key_type) :: keys(size(fixed_accuracy_keys))

    keys = fixed_accuracy_keys
    keys(2)%words = joined(solution_methods())
  end function accuracy_keys

end module gestell_task_common_keys
