!> What the library says about the paper's machine, from the input file in data/.
module library_values
  use gestell_api_numerics, only: analyse, analysis_type, dp, error_type
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_path_real
  implicit none (type, external)
  private

  public :: solve_by_library

contains

  !> The initial state of the periodic vibration and rho_max at a speed in 1/min, with the bounds that the library claims;
  !> the displacements at equidistant times from 0 to T, shape (3, times), and the claimed errors of their peaks.
  subroutine solve_by_library(speed_rpm, x0, x0_error, rho_max, rho_error, turn, turn_error)
    real(dp), intent(in) :: speed_rpm
    real(dp), intent(out) :: x0(6), x0_error(6), rho_max, rho_error, turn(:, :), turn_error(3)
    type(document_type) :: doc
    type(configuration_type) :: configuration
    type(analysis_type) :: analysis
    type(error_type), allocatable :: error

    call read_document("data/khang_four_bar.nml", doc, error)
    if (.not. allocated(error)) call set_path_real(doc, input_schema(), "drive.speed_rpm", speed_rpm, error)
    if (.not. allocated(error)) call check_document(doc, input_schema(), error)
    if (.not. allocated(error)) call read_configuration(doc, configuration, error)
    configuration%analysis%points = size(turn, 2) - 1
    if (.not. allocated(error)) call analyse(configuration%frame, configuration%analysis, configuration%accuracy, analysis, error)
    if (allocated(error)) error stop "khang_tables: " // error%message
    x0 = analysis%vibration%start%x0
    x0_error = analysis%vibration%start%error
    turn = analysis%vibration%history(:3, :)
    turn_error = analysis%vibration%peak_error(:3)
    rho_max = abs(analysis%multipliers%rho(1))
    rho_error = rho_max * analysis%multipliers%error(1)
  end subroutine solve_by_library

end module library_values
