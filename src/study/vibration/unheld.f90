!> Directions in which nothing holds the frame: why there is no periodic vibration, in words.
module gestell_study_vibration_unheld
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_study_frame_model_path, only: units_of
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: describe_unheld

  !> A direction whose stiffness is below this part of the greatest one counts as free.
  real(dp), parameter :: no_stiffness = 1.0e-10_dp

contains

  !> What the frame can do freely, with what to do about it; empty where mounting and weights hold it in all directions.
  subroutine describe_unheld(frame, sentence)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable, intent(out) :: sentence
    character(len=*), parameter :: remedy = ": add a &support, or stiffness of the &foundation"
    type(averaged_system) :: means
    real(dp), allocatable :: units(:), stiffness(:, :), motions(:, :)
    real(dp) :: center(2)
    character(len=:), allocatable :: names
    integer :: f, i

    sentence = ""
    call frame%averaged(means)
    f = size(frame%free)
    allocate(units(frame%dofs()))
    units = units_of(frame)
    stiffness = (means%c + transpose(means%c)) / 2 * spread(units(frame%free), 1, f) * spread(units(frame%free), 2, f)
    call find_kernel(stiffness, motions)
    if (size(motions, 2) == 0) return
    motions = motions * spread(units(frame%free), 2, size(motions, 2))
    if (size(motions, 2) == 1 .and. f == 3 .and. frame%dofs() == 3) then
      if (abs(motions(3, 1)) > no_stiffness * maxval(abs(motions(:, 1)))) then
        center = [-motions(2, 1), motions(1, 1)] / motions(3, 1)
        where (abs(center) < 1.0e-9_dp) center = 0
        sentence = "the frame turns freely about the point (" // concise(center(1), 4) // ", " // concise(center(2), 4) // ")" &
          & // remedy
        return
      end if
    end if
    names = ""
    do i = 1, f
      if (.not. maxval(abs(motions(i, :))) > no_stiffness * maxval(abs(motions))) cycle
      if (names /= "") names = names // ", "
      names = names // trim(dof_names(frame%free(i)))
    end do
    sentence = "the frame is not held in " // names // remedy
  end subroutine describe_unheld

  !> The vectors that a symmetric matrix takes to zero, shape (n, vectors), by elimination with full pivoting.
  pure subroutine find_kernel(matrix, kernel)
    real(dp), intent(in) :: matrix(:, :)
    real(dp), allocatable, intent(out) :: kernel(:, :)
    real(dp) :: a(size(matrix, 1), size(matrix, 1)), greatest
    integer :: order(size(matrix, 1)), place(2), n, rank, i, k

    a = matrix
    n = size(a, 1)
    order = [(i, i = 1, n)]
    greatest = maxval(abs(a))
    do rank = 0, n - 1
      place = rank + maxloc(abs(a(rank + 1:, rank + 1:)))
      if (.not. abs(a(place(1), place(2))) > no_stiffness * greatest) exit
      k = rank + 1
      a([k, place(1)], :) = a([place(1), k], :)
      a(:, [k, place(2)]) = a(:, [place(2), k])
      order([k, place(2)]) = order([place(2), k])
      a(k, :) = a(k, :) / a(k, k)
      do i = 1, n
        if (i /= k) a(i, :) = a(i, :) - a(i, k) * a(k, :)
      end do
    end do
    allocate(kernel(n, n - rank), source=0.0_dp)
    do k = rank + 1, n
      kernel(order(k), k - rank) = 1
      kernel(order(:rank), k - rank) = -a(:rank, k)
    end do
  end subroutine find_kernel

end module gestell_study_vibration_unheld
