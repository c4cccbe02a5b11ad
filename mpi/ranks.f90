!> Communication between MPI ranks.
module ranks
  use gestell_base_error, only: error_type, fatal_error
  use mpi_f08, only: mpi_2integer, mpi_allreduce, mpi_bcast, mpi_character, mpi_comm_rank, mpi_comm_size, mpi_comm_world, &
    & mpi_in_place, mpi_integer, mpi_integer8, mpi_logical, mpi_lor, mpi_max, mpi_min, mpi_minloc
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: number_of_ranks, own_rank, same_everywhere, share_error, share_marks

contains

  integer function own_rank()
    call mpi_comm_rank(mpi_comm_world, own_rank)
  end function own_rank

  integer function number_of_ranks()
    call mpi_comm_size(mpi_comm_world, number_of_ranks)
  end function number_of_ranks

  !> Gives all ranks the same error: that of the rank with the smallest `order` among the ranks with an error. By default `order` is
  !> the rank's number.
  subroutine share_error(error, order)
    type(error_type), allocatable, intent(inout) :: error
    integer, intent(in), optional :: order
    character(len=:), allocatable :: message
    integer :: own_entry(2), first(2), description(3)

    own_entry = [huge(1), own_rank()]
    if (allocated(error)) then
      own_entry(1) = own_entry(2)
      if (present(order)) own_entry(1) = order
    end if
    call mpi_allreduce(own_entry, first, 1, mpi_2integer, mpi_minloc, mpi_comm_world)
    if (first(1) == huge(1)) return
    description = 0
    if (first(2) == own_entry(2)) then
      message = error%message
      description = [len(message), error%code, merge(1, 0, error%write_failed)]
    end if
    call mpi_bcast(description, 3, mpi_integer, first(2), mpi_comm_world)
    if (first(2) /= own_entry(2)) allocate(character(len=description(1)) :: message)
    call mpi_bcast(message, description(1), mpi_character, first(2), mpi_comm_world)
    if (allocated(error)) deallocate(error)
    call fatal_error(error, message, description(2))
    error%write_failed = description(3) == 1
  end subroutine share_error

  !> Sets each mark on all ranks that is set on at least one rank.
  subroutine share_marks(marks)
    logical, contiguous, intent(inout) :: marks(:)

    call mpi_allreduce(mpi_in_place, marks, size(marks), mpi_logical, mpi_lor, mpi_comm_world)
  end subroutine share_marks

  !> True if all ranks have the same number.
  logical function same_everywhere(number)
    integer(int64), intent(in) :: number
    integer(int64) :: smallest, largest

    call mpi_allreduce(number, smallest, 1, mpi_integer8, mpi_min, mpi_comm_world)
    call mpi_allreduce(number, largest, 1, mpi_integer8, mpi_max, mpi_comm_world)
    same_everywhere = smallest == largest
  end function same_everywhere

end module ranks
