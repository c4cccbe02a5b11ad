!> Finds directions in which the mounting does not hold the frame.
module gestell_study_vibration_free_directions
  use gestell_base_error, only: error_type
  use gestell_base_key, only: joined
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_math_lapack, only: symmetric_pencil
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: describe_free_directions

  !> `rounding`: a stiffness counts as zero if it is below this fraction of the largest stiffness. `small_part`: elements of a
  !> motion are dropped if they are below this fraction of its largest element.
  real(dp), parameter :: rounding = 1.0e-13_dp, small_part = 1.0e-6_dp

  !> Length of the sentences. The length is fixed, because gfortran keeps the length of a text of variable length in memory that
  !> threads share.
  integer, parameter :: sentence_length = 160

contains

  !> Sentence that names the directions in which the mounting does not hold the frame when it is at rest. Empty if the mounting
  !> holds the frame in all directions.
  function describe_free_directions(frame) result(sentence)
    class(frame_type), intent(in) :: frame
    character(len=sentence_length) :: sentence
    type(averaged_system) :: model
    type(error_type), allocatable :: error
    real(dp), allocatable :: squares(:), vectors(:, :), unit(:)
    logical, allocatable :: along(:)
    real(dp) :: nothing
    integer :: i, directions

    sentence = ""
    call frame%check(error)
    if (allocated(error)) return
    call frame%averaged(model)
    call symmetric_pencil((model%c + transpose(model%c)) / 2, model%m, squares, error, vectors)
    if (allocated(error)) return
    nothing = rounding * maxval(abs(squares))
    directions = count(abs(squares) <= nothing)
    if (directions == 0) return
    unit = [(sqrt(model%m(i, i)), i = 1, size(squares))]
    along = [(all(abs(model%c(:, i)) <= nothing * unit * unit(i)), i = 1, size(squares))]
    if (count(along) == directions) then
      sentence = "the frame is not held in " // trim(joined(dof_names(pack(frame%free, along)))) // ": add a &support"
    else if (directions == 1) then
      i = minloc(abs(squares), dim=1)
      sentence = "the frame " // trim(describe_direction(frame, unit * vectors(:, i), vectors(:, i))) // ": add another &support"
    else
      sentence = "the frame is not held in " // text(directions) // " directions: add &support groups that hold it in these " // &
        &   "directions"
    end if
  end function describe_free_directions

  !> Describes the direction in which the frame is free to move, if there is only one. `parts`: elements of `motion` in comparable
  !> units.
  pure function describe_direction(frame, parts, motion) result(words)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: parts(:), motion(:)
    character(len=sentence_length) :: words
    real(dp) :: q(6)

    q = 0
    q(frame%free) = merge(motion, 0.0_dp, abs(parts) > small_part * maxval(abs(parts)))
    if (frame%dofs() > 3) then
      words = "is not held in a combined motion of " // trim(joined(dof_names(pack(frame%free, abs(q(frame%free)) > 0))))
    else if (abs(q(3)) > 0) then
      words = "can turn freely about the point (" // concise(-q(2) / q(3), 4) // ", " // concise(q(1) / q(3), 4) // ") m from F"
    else
      words = "is not held along " // concise(modulo(atan2(q(2), q(1)) * 180 / pi, 180.0_dp), 4) // " deg"
    end if
  end function describe_direction

end module gestell_study_vibration_free_directions
