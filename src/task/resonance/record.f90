!> A point of a curve as it is kept for a run that goes on.
module gestell_task_resonance_record
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: exchange_point

contains

  !> Writes the point, or reads it; what was measured beside the quantities' own values is not kept.
  subroutine exchange_point(point, record)
    type(speed_point_type), intent(inout) :: point
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)
    logical :: free

    call record%pass(point%speed)
    call record%pass(point%state)
    call record%pass(point%linear)
    call record%pass(point%from_fold)
    call record%pass(point%values)
    if (allocated(point%strongest)) words = int(point%strongest, int64)
    call record%pass_words(words)
    point%strongest = int(words)
    free = allocated(point%turns)
    call record%pass(free)
    if (free) then
      call record%pass(point%turns)
      call record%pass(point%growth)
      call record%pass(point%averaged_turns)
      call record%pass(point%crank)
      call record%pass(point%drive_turns)
    end if
    words = transfer(point%moved, [0_int64])
    call record%pass_words(words)
    point%moved = transfer(words, point%moved)
  end subroutine exchange_point

end module gestell_task_resonance_record
