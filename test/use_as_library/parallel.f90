!> Many frames at once on several threads give the same bits as one after the other. Stops with an error otherwise.
program parallel
  use gestell_api_numerics, only: accuracy_type, analyse, analysis_type, damping_matrix, dp, error_type, evidence, evidence_type, &
    & frame_type, linkage_type, new_frame, pi, stiffness_matrix, support_type, analysis_options
  use, intrinsic :: iso_fortran_env, only: int64
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  implicit none (type, external)

  integer, parameter :: frames = 64, numbers = 40
  real(dp) :: serial(numbers, frames), threaded(numbers, frames)
  character(len=300) :: serial_words(frames), threaded_words(frames)
  integer :: workers(frames), k

  do k = 1, frames
    call solve(k, serial(:, k), serial_words(k))
  end do
  !$omp parallel do schedule(dynamic, 1)
  do k = 1, frames
    call solve(k, threaded(:, k), threaded_words(k))
    workers(k) = omp_get_thread_num()
  end do
  !$omp end parallel do

  print "(i0, a, i0, a)", frames, " frames on ", omp_get_max_threads(), " threads"
  if (all(workers == workers(1))) error stop "one thread did everything: nothing was tried"
  if (any(transfer(serial, [0_int64]) /= transfer(threaded, [0_int64]))) error stop "threads change the results"
  if (any(serial_words /= threaded_words)) error stop "threads change the words"
  do k = 2, frames
    if (all(abs(serial(:, k) - serial(:, k - 1)) <= 0)) error stop "the frames do not differ"
    if (serial_words(k) == serial_words(k - 1)) error stop "the words do not differ"
  end do

contains

  !> Multipliers, their errors, start, peaks and one row of the vibration of the k-th of a family of frames; the verdict
  !> and the message about a linkage that cannot turn in words.
  subroutine solve(k, results, words)
    integer, intent(in) :: k
    real(dp), intent(out) :: results(numbers)
    character(len=300), intent(out) :: words
    type(linkage_type) :: linkage
    type(support_type) :: supports(2)
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(evidence_type) :: found
    type(error_type), allocatable :: error

    call linkage%ground("A0", [0.0_dp, 0.0_dp], error)
    if (.not. allocated(error)) call linkage%ground("B0", [0.40_dp, 0.0_dp], error)
    if (.not. allocated(error)) call linkage%crank("A", "A0", 0.07_dp, 0.0_dp, error)
    if (.not. allocated(error)) call linkage%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp + 0.001_dp * k], 1, error)
    if (.not. allocated(error)) call linkage%link("coupler", "A", "B", 0.6_dp, 0.007_dp, [0.18_dp, 0.0_dp], error)
    if (allocated(error)) error stop "no linkage"
    supports = [support_type([-0.3_dp, -0.2_dp], [4.0e5_dp, 4.0e5_dp], [50.0_dp, 50.0_dp]), &
      & support_type([0.3_dp, -0.2_dp], [4.0e5_dp, 4.0e5_dp + 1.0e3_dp * k], [50.0_dp, 50.0_dp])]
    call new_frame(frame, linkage, 18.0_dp, 0.78_dp, [-0.2_dp, 0.2_dp], stiffness_matrix(supports), &
      & damping_matrix(supports), (150 + 5 * k) * pi / 30, error)
    if (.not. allocated(error)) call analyse(frame, analysis_options(), accuracy_type(), analysis, error)
    if (allocated(error)) error stop "no analysis"
    call evidence(analysis%floquet, found)
    associate (multipliers => analysis%multipliers, vibration => analysis%vibration)
      results = [real(multipliers%rho), aimag(multipliers%rho), multipliers%error, vibration%start%x0, vibration%peak, &
        & vibration%history(:6, 100), found%error]
      words = multipliers%verdict()
    end associate

    call linkage%rrr("C", ["B ", "A0"], [0.25_dp + 0.001_dp * k, 0.12_dp], 1, error)
    call linkage%prepare(error)
    if (.not. allocated(error)) error stop "this linkage cannot turn"
    words = trim(words) // " " // error%message
  end subroutine solve

end program parallel
