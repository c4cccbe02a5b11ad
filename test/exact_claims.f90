!> What the library reports about an input file. Only this module knows how the library is called for the exact frame.
module exact_claims
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: joint_forces, quantity_type
  use gestell_output_result, only: result_type
  use gestell_study_vibration_statistics, only: history_of, statistics_type, compute_statistics
  use gestell_task_common_task, only: any_task_type
  use gestell_task_common_context, only: context_type
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_task_registry, only: input_schema, read_input
  use gestell_task_registry_run, only: prepare_tasks, run_tasks
  implicit none (type, external)
  private

  public :: claim_of, solve_text

  integer, parameter, public :: orders = 12, most_name = 20

  !> A quantity over the period: its history (both ends), a bound on its error at any time, which also holds for its rms, peak
  !> with a bound, amplitudes. Components that the library does not report are not allocated.
  type, public :: claim_type
    character(len=most_name) :: name = ""
    real(dp), allocatable :: history(:), amplitudes(:)
    real(dp) :: error = 0, peak = 0, peak_error = 0, rms = 0
  end type claim_type

  !> Static force and least compression, with a bound, at a place where forces act.
  type, public :: place_type
    character(len=12) :: name = ""
    real(dp) :: static(2) = 0, least = 0, min_error = 0
  end type place_type

  type, public :: claims_type
    !> Why there are no results, or no vibration; empty if there are; its code.
    character(len=:), allocatable :: refusal
    !> The mechanism cannot turn, or the input is refused.
    logical :: impossible = .false.
    !> Processor time of the solution (s).
    real(dp) :: seconds = 0
    character(len=9) :: verdict = ""
    complex(dp), allocatable :: rho(:)
    !> Relative.
    real(dp), allocatable :: rho_error(:), log_abs(:)
    type(claim_type), allocatable :: quantities(:)
    type(claim_type) :: torque
    type(place_type), allocatable :: places(:)
    real(dp) :: band = 0, band_error = 0
    !> q and q' over the period, both ends, shape (6, points + 1); allocated with the vibration.
    real(dp), allocatable :: history(:, :)
  end type claims_type

contains

  !> Runs the tasks of the input and returns their claims, including these quantities.
  subroutine solve_text(text, names, claims)
    character(len=*), intent(in) :: text, names(:)
    type(claims_type), intent(out) :: claims
    type(document_type) :: document
    type(schema_type) :: schema
    type(any_task_type), allocatable :: tasks(:)
    type(context_type) :: context
    type(result_type) :: result
    type(error_type), allocatable :: error
    real(dp) :: before, after
    integer :: k

    claims%refusal = ""
    call cpu_time(before)
    call parse_document(text, "text", document, error)
    schema = input_schema()
    if (.not. allocated(error)) call check_document(document, schema, error)
    if (.not. allocated(error)) call read_input(document, schema, tasks, context%configuration, error)
    if (.not. allocated(error)) then
      if (allocated(context%configuration%impossible)) allocate(error, source=context%configuration%impossible)
    end if
    if (allocated(error)) then
      claims%impossible = .true.
      claims%refusal = error%message
      return
    end if
    context%keep_all_rows = .true.
    context%configuration%analysis%rows = joint_forces
    context%reports = .false.
    call prepare_tasks(tasks, context, result, error)
    if (.not. allocated(error)) call run_tasks(tasks, context, result, error)
    call cpu_time(after)
    claims%seconds = after - before
    if (.not. allocated(error) .and. allocated(result%failure)) allocate(error, source=result%failure)
    if (allocated(error)) claims%refusal = error%message
    if (.not. allocated(context%analysis%multipliers)) return
    claims%verdict = context%analysis%multipliers%verdict()
    claims%rho = context%analysis%multipliers%rho
    claims%rho_error = context%analysis%multipliers%error
    claims%log_abs = context%analysis%multipliers%log_abs
    if (.not. allocated(context%analysis%vibration)) return
    claims%history = context%analysis%vibration%history(:6, :)
    allocate(claims%quantities(size(names)))
    do k = 1, size(names)
      claims%quantities(k)%name = names(k)
      call read_quantity(context, trim(names(k)), claims%quantities(k))
    end do
    call read_torque(context, claims%torque)
    call read_places(result, claims)
  end subroutine solve_text

  !> The quantity of a name, or of the guides and everything else together, as total.fx.
  subroutine read_quantity(context, name, claim)
    type(context_type), intent(in) :: context
    character(len=*), intent(in) :: name
    type(claim_type), intent(inout) :: claim
    type(quantity_type) :: quantity
    type(statistics_type) :: statistics
    type(error_type), allocatable :: error
    integer :: k

    associate (frame => context%analysis%frame, vibration => context%analysis%vibration)
      call find_quantity(frame, context%configuration%probes, name, quantity, error)
      if (.not. allocated(error)) call compute_statistics(vibration, quantity, statistics, error)
      if (.not. allocated(error)) call history_of(vibration, quantity, claim%history, error)
    end associate
    if (allocated(error)) then
      if (allocated(claim%history)) deallocate(claim%history)
      return
    end if
    claim%error = statistics%error
    claim%peak = statistics%peak
    claim%peak_error = statistics%peak_error
    claim%rms = statistics%rms
    claim%amplitudes = [(statistics%amplitude(k), k = 1, orders)]
  end subroutine read_quantity

  !> Takes the claims about the torque. The library bounds its peak only, the power of the drive at all times.
  subroutine read_torque(context, claim)
    type(context_type), intent(in) :: context
    type(claim_type), intent(inout) :: claim
    type(drive_type) :: drive
    type(error_type), allocatable :: error
    logical :: known

    call find_drive(context%analysis%frame, context%analysis%vibration, drive, known, error)
    if (allocated(error) .or. .not. known) return
    claim%name = "torque"
    claim%history = drive%history(1, :)
    claim%error = drive%peak_error
    claim%peak = abs(drive%actual%peak)
    claim%peak_error = drive%peak_error
    claim%rms = drive%actual%rms
    allocate(claim%amplitudes(0))
  end subroutine read_torque

  !> What the tables of forces and probes contain in addition to the quantities.
  subroutine read_places(result, claims)
    type(result_type), intent(in) :: result
    type(claims_type), intent(inout) :: claims
    integer :: k, n

    allocate(claims%places(0))
    do n = 1, size(result%tables)
      select case (result%tables(n)%name)
      case ("probes")
        claims%band = number(n, "v_rms_band_mm_s", 1)
        claims%band_error = number(n, "v_rms_band_error_mm_s", 1)
      case ("supports")
        if (column(n, "least_compression_N") == 0) cycle
        deallocate(claims%places)
        allocate(claims%places(result%tables(n)%rows))
        do k = 1, size(claims%places)
          claims%places(k)%name = result%tables(n)%columns(1)%word(k)
          claims%places(k)%static = [number(n, "static_fx_N", k), number(n, "static_fy_N", k)]
          claims%places(k)%least = number(n, "least_compression_N", k)
          claims%places(k)%min_error = number(n, "least_compression_error_N", k)
        end do
      case default
      end select
    end do

  contains

    integer function column(n, key)
      integer, intent(in) :: n
      character(len=*), intent(in) :: key

      do column = size(result%tables(n)%columns), 1, -1
        if (result%tables(n)%columns(column)%key == key) return
      end do
    end function column

    real(dp) function number(n, key, row)
      integer, intent(in) :: n, row
      character(len=*), intent(in) :: key

      number = result%tables(n)%columns(column(n, key))%numbers(row)
    end function number

  end subroutine read_places

  !> The claim about one quantity; its components are not allocated if there is none.
  pure type(claim_type) function claim_of(claims, name)
    type(claims_type), intent(in) :: claims
    character(len=*), intent(in) :: name
    integer :: k

    do k = 1, size(claims%quantities)
      if (claims%quantities(k)%name == name) claim_of = claims%quantities(k)
    end do
    if (name == "torque") claim_of = claims%torque
  end function claim_of

end module exact_claims
