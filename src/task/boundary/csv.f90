!> boundary.csv.
module gestell_task_boundary_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact, text
  use gestell_output_table_csv, only: write_table
  use gestell_task_boundary_task, only: border_results_type
  implicit none (type, external)
  private

  public :: write_borders

contains

  !> Writes the borders over `paths` into `folder`; `preamble` heads the file. Error: it cannot be written.
  subroutine write_borders(folder, preamble, paths, results, error)
    character(len=*), intent(in) :: folder, preamble(:), paths(:)
    type(border_results_type), intent(in) :: results
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: header
    character(len=12), allocatable :: curves(:)
    character(len=96), allocatable :: tails(:)
    real(dp), allocatable :: values(:, :)
    integer :: i, n, k

    if (allocated(results%map)) then
      n = size(results%map%vertices)
    else
      n = size(results%values)
    end if
    allocate(curves(n), tails(n), values(size(paths) + 1, n))
    header = "curve"
    do k = 1, size(paths)
      header = header // "," // trim(paths(k))
    end do
    header = header // ",arg_rad,kind"
    do k = 1, size(paths)
      header = header // "," // trim(paths(k)) // "_error"
    end do
    if (allocated(results%map)) then
      do i = 1, n
        associate (v => results%map%vertices(i))
          curves(i) = text(v%curve)
          values(:, i) = [v%parameters, v%arg_rad]
          tails(i) = trim(v%kind) // "," // exact(v%error(1)) // "," // exact(v%error(2))
        end associate
      end do
    else
      header = header // ",below,above,vibration"
      do i = 1, n
        associate (v => results%values(i))
          curves(i) = text(i)
          values(:, i) = [v%value, v%arg_rad]
          tails(i) = trim(v%kind) // "," // exact(v%error) // "," // trim(v%below) // "," // trim(v%above) // "," &
            & // text(v%vibration)
        end associate
      end do
    end if
    call write_table(folder, "boundary.csv", heads(preamble, paths, results), header, values, error, labels=curves, tails=tails)
  end subroutine write_borders

  !> The preamble, and behind it a line for each place that the search left open.
  pure function heads(preamble, paths, results) result(lines)
    character(len=*), intent(in) :: preamble(:), paths(:)
    type(border_results_type), intent(in) :: results
    character(len=max(len(preamble), 3 * len(paths) + 120)), allocatable :: lines(:)
    character(len=*), parameter :: words = ": a border could not be excluded"
    integer :: i, n

    n = 0
    if (allocated(results%rest%places)) n = size(results%rest%places)
    if (allocated(results%map)) n = size(results%map%places)
    allocate(lines(size(preamble) + n))
    lines(:size(preamble)) = preamble
    do i = 1, n
      if (allocated(results%map)) then
        associate (place => results%map%places(i), along => maxloc(results%map%places(i)%width, dim=1))
          lines(size(preamble) + i) = "open: " // trim(paths(1)) // " = " // exact(place%parameters(1)) // ", " // trim(paths(2)) &
            & // " = " // exact(place%parameters(2)) // " within " // exact(place%width(along)) // " along " &
            & // trim(paths(along)) // words
        end associate
      else
        associate (place => results%rest%places(i))
          lines(size(preamble) + i) = "open: " // trim(paths(1)) // " = " // exact(place%value) // " within " &
            & // exact(place%width) // words
        end associate
      end if
    end do
  end function heads

end module gestell_task_boundary_csv
