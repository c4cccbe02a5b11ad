!> Joint forces of a machine on rigid ground, in the form of a vibration whose displacements are zero.
module gestell_study_vibration_rigid_ground
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: find_series
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: exact_rows, joint_sources
  use gestell_study_vibration, only: vibration_type
  use gestell_study_vibration_motion, only: add_joints, bound_joint_forces, motion_rows
  implicit none (type, external)
  private

  public :: solve_on_rigid_ground

contains

  !> Computes the joint forces of the mechanisms of `frame` while the frame rests. Their bounds contain rounding errors alone.
  subroutine solve_on_rigid_ground(frame, points, harmonics, vibration)
    class(frame_type), intent(in) :: frame
    !> Number of intervals of the history, and minimum number of harmonics
    integer, intent(in) :: points, harmonics
    type(vibration_type), intent(out) :: vibration
    !> Maximum number of samples per period; a series is resolved if its upper third is smaller than `resolved` times its maximum
    integer, parameter :: most = 2**14
    real(dp), parameter :: resolved = 1.0e-12_dp
    !> Assumed number of rounding errors in each acceleration
    real(dp), parameter :: roundings = 16
    real(dp), allocatable :: errors(:)
    integer :: first, k, n, rows

    rows = motion_rows(frame, joint_sources)
    first = exact_rows(frame) + 1
    vibration%last_rows = joint_sources
    allocate(vibration%motion_series(rows), errors(rows))
    n = max(64, 2 * harmonics + 2, min(4 * frame%least_steps, most))
    do
      call sample(n, vibration%motion, vibration%joint_parts)
      call find_series(vibration%motion, vibration%motion_series)
      associate (maximum => maxval(abs(vibration%motion(first:, :))))
        if (2 * n > most .or. all([(vibration%motion_series(k)%tail() * vibration%motion_series(k)%largest_term() &
          & <= resolved * maximum, k = first, rows)])) exit
      end associate
      n = 2 * n
    end do
    call sample(points, vibration%motion_history)
    vibration%motion_history = reshape([vibration%motion_history, vibration%motion_history(:, 1)], [rows, points + 1])
    errors = 0
    call bound_joint_forces(frame, phases(n), vibration%motion, roundings * (epsilon(1.0_dp) + frame%rounding), errors)
    allocate(vibration%motion_errors%differences(rows, 0))
    vibration%motion_errors%rounding = errors

  contains

    !> Equidistant phases of the period.
    pure function phases(count)
      integer, intent(in) :: count
      real(dp) :: phases(count)
      integer :: i

      phases = [(real(i, dp) / count, i = 0, count - 1)]
    end function phases

    subroutine sample(count, motion, parts)
      integer, intent(in) :: count
      real(dp), allocatable, intent(out) :: motion(:, :)
      real(dp), allocatable, intent(out), optional :: parts(:, :, :)

      allocate(motion(rows, count), source=0.0_dp)
      call add_joints(frame, phases(count), motion, parts)
    end subroutine sample

  end subroutine solve_on_rigid_ground

end module gestell_study_vibration_rigid_ground
