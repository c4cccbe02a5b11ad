!> Tabulates the motion of the sliders: stroke, maximum speed and acceleration, and the time ratio of forward to return motion.
module gestell_task_drawing_strokes
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: unjudged
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagnosis, only: diagnosis_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: degree, metre, metre_per_s, metre_per_s2, plain
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: stroke_table

contains

  !> The table strokes.csv, with one row for each slider.
  pure type(table_type) function stroke_table(frame, linkage, diagnosis) result(table)
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(in) :: diagnosis
    integer, allocatable :: sliders(:)
    character(len=:), allocatable :: names(:)
    real(dp), allocatable :: forward(:)
    integer :: i

    sliders = pack([(i, i = 1, size(linkage%joints))], [(diagnosis%joints(i)%slides, i = 1, size(linkage%joints))])
    allocate(character(len=maxval([0, (len(linkage%joints(i)%name), i = 1, size(linkage%joints))])) :: names(size(sliders)))
    do i = 1, size(sliders)
      names(i) = linkage%joints(sliders(i))%name
    end do
    table = new_table("strokes", "Sliders", "Motion of the sliders along their guides.", unjudged, shown=.true.)
    associate (joints => diagnosis%joints(sliders), speed => abs(frame%speed))
      call table%add("slider", "name of the joint", names)
      call table%add("stroke", metre, "distance between the ends of the motion", joints%travel(2) - joints%travel(1))
      call table%add("speed", metre_per_s, "maximum speed", joints%rate * speed)
      call table%add("acceleration", metre_per_s2, "maximum acceleration", joints%second_rate * speed**2)
      ! If the crank turns in the opposite direction, the return motion becomes the forward motion. Without a single forward motion
      ! in the period, `forward` is not positive.
      forward = merge(2 * pi - joints%forward, joints%forward, frame%speed < 0)
      forward = merge(forward, ieee_value(1.0_dp, ieee_quiet_nan), joints%forward > 0)
    end associate
    call table%add("forward", degree, "crank angle during which the slider moves in the guide's direction", &
      & forward * linkage%turns * 180 / pi)
    call table%add("time_ratio", plain, "time of the forward motion divided by the time of the return motion", &
      & forward / (2 * pi - forward))
  end function stroke_table

end module gestell_task_drawing_strokes
