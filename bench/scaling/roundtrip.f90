!> Seconds that rank 1 waits for a number from the queue of rank 0, as CSV; `idle`: rank 0 waits inside MPI, `busy`: it
!> computes for `pause` seconds between its calls, `ahead`: and rank 1 does so between question and answer. Two ranks.
program roundtrip
  use mpi_f08, only: mpi_barrier, mpi_comm_world, mpi_finalize, mpi_init, mpi_wtime
  use queue, only: open_queue, queue_type
  use ranks, only: own_rank
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)

  real(real64), parameter :: pause = 0.05_real64

  call mpi_init()
  if (own_rank() == 0) print "(a)", "what,number,points,seconds,inside,calls,bytes"
  call measure("idle", 20000)
  call measure("busy", 40)
  call measure("ahead", 40)
  call mpi_finalize()

contains

  subroutine measure(what, calls)
    character(len=*), intent(in) :: what
    integer, intent(in) :: calls
    type(queue_type) :: queue
    real(real64) :: begin, waited
    integer :: i, number

    call open_queue(queue, 10 * calls)
    call mpi_barrier(mpi_comm_world)
    waited = 0
    if (own_rank() == 1) then
      do i = 1, calls
        begin = mpi_wtime()
        call queue%request_next()
        waited = waited + mpi_wtime() - begin
        if (what == "ahead") call compute()
        begin = mpi_wtime()
        number = queue%answer()
        waited = waited + mpi_wtime() - begin
      end do
      print "(3a, es11.4, a, i0, a)", "counter_", what, ",1,0,", waited / calls, ",0,", calls, ",0"
    else if (what /= "idle") then
      do i = 1, 2 * calls
        call queue%request_next()
        call compute()
        number = queue%answer()
      end do
    end if
    call queue%close()
  end subroutine measure

  !> Works without a call of MPI.
  subroutine compute()
    real(real64) :: begin

    begin = mpi_wtime()
    do while (mpi_wtime() - begin < pause)
    end do
  end subroutine compute

end program roundtrip
