!> Counts the verdicts of a sweep and records its extreme values, tile by tile.
module gestell_task_sweep_summary
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: integer_text
  use gestell_base_verdict, only: last_number, verdict_numbered, verdict_type
  use gestell_study_vibration_small_motion, only: small_turn
  use gestell_model_space, only: is_rotation
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: last_peak, rho_max, verdict, xi_peak
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> A verdict and the number of points with this verdict.
  type, public :: verdict_count_type
    type(verdict_type) :: verdict
    integer(int64) :: points = 0
  end type verdict_count_type

  !> Summary of some points of a sweep. Each component has eight-byte elements, so that `transfer` can convert a summary to 64-bit
  !> words of a file.
  type, public :: summary_type
    integer(int64) :: points = 0
    !> Number of points with each verdict. The index is the number that represents the verdict. All are 0 if the verdict is not
    !> requested.
    integer(int64) :: verdicts(0:last_number) = 0
    !> Smallest (`least`) and largest (`most`) value of rho_max, the largest modulus of a multiplier. If there is no value,
    !> `least` exceeds `most`.
    real(dp) :: least = huge(1.0_dp), most = -huge(1.0_dp)
    !> Indices of the point with the largest rho_max, one for each axis.
    integer(int64) :: where(2) = 0
    !> `turned`: number of points at which the frame rotates too far for linearised equations. `furthest`: number of the degree of
    !> freedom that has the largest rotation.
    integer(int64) :: turned = 0, furthest = 0
    !> Largest rotation of the frame at any point (rad).
    real(dp) :: max_turn = 0
    !> `solutions`: number of solutions for all tiles. `checks`: number of points that were compared with separate solutions.
    integer(int64) :: solutions = 0, checks = 0
    !> Largest deviation found in the comparisons with separate solutions, relative to the separate solution.
    real(dp) :: deviation = 0
  contains
    procedure :: add_points, add, verdict_counts, tally
  end type summary_type

  type(summary_type), parameter :: nothing = summary_type()
  !> Number of 64-bit words that a summary occupies.
  integer, parameter, public :: summary_words = storage_size(nothing) / storage_size(0_int64)

contains

  !> Adds a block of points that begins at the indices `first` on the axes. `values` has the shape (requested columns, points of the
  !> second axis, points of the first axis).
  pure subroutine add_points(self, options, first, values)
    class(summary_type), intent(inout) :: self
    type(sweep_options), intent(in) :: options
    integer, intent(in) :: first(2)
    real(dp), intent(in) :: values(:, :, :)
    logical :: turns(size(values, 2), size(values, 3))
    real(dp) :: maximum
    integer :: ordered(count(options%columns)), k, word, at(2)

    self%points = self%points + size(values, 2, kind=int64) * size(values, 3)
    turns = .false.
    ordered = options%ordered()
    do k = 1, size(ordered)
      select case (ordered(k))
      case (verdict)
        do word = 0, ubound(self%verdicts, 1)
          self%verdicts(word) = self%verdicts(word) + count(nint(values(k, :, :)) == word)
        end do
      case (rho_max)
        associate (rho => values(k, :, :))
          if (all(ieee_is_nan(rho))) cycle
          self%least = min(self%least, minval(rho, mask=.not. ieee_is_nan(rho)))
          at = maxloc(rho, mask=.not. ieee_is_nan(rho))
          if (.not. rho(at(1), at(2)) > self%most) cycle
          self%most = rho(at(1), at(2))
          self%where = first + [at(2) - 1, at(1) - 1]
        end associate
      case (xi_peak:last_peak)
        if (.not. is_rotation(ordered(k) - xi_peak + 1)) cycle
        ! A comparison with NaN would raise a floating-point exception, so NaN is replaced by 0.
        associate (peaks => merge(0.0_dp, values(k, :, :), ieee_is_nan(values(k, :, :))))
          turns = turns .or. peaks > small_turn
          maximum = maxval([0.0_dp, peaks])
        end associate
        if (.not. maximum > self%max_turn) cycle
        self%max_turn = maximum
        self%furthest = ordered(k) - xi_peak + 1
      case default
        ! Other columns do not contribute to the summary.
      end select
    end do
    self%turned = self%turned + count(turns)
  end subroutine add_points

  !> The verdicts that occur, each with its number of points, in the order of the numbers that represent them in files.
  pure function verdict_counts(self) result(list)
    class(summary_type), intent(in) :: self
    type(verdict_count_type), allocatable :: list(:)
    integer :: k

    list = pack([(verdict_count_type(verdict_numbered(k), self%verdicts(k)), k = 0, last_number)], self%verdicts > 0)
  end function verdict_counts

  !> Adds the summary of other points. If several points have the same largest rho_max, the first one in the order of the grid is
  !> kept.
  pure subroutine add(self, other)
    class(summary_type), intent(inout) :: self
    type(summary_type), intent(in) :: other
    logical :: first

    self%points = self%points + other%points
    self%verdicts = self%verdicts + other%verdicts
    self%least = min(self%least, other%least)
    first = other%where(1) < self%where(1) .or. other%where(1) == self%where(1) .and. other%where(2) < self%where(2)
    if (other%most > self%most .or. .not. other%most < self%most .and. first) self%where = other%where
    self%most = max(self%most, other%most)
    self%turned = self%turned + other%turned
    if (other%max_turn > self%max_turn) self%furthest = other%furthest
    self%max_turn = max(self%max_turn, other%max_turn)
    self%solutions = self%solutions + other%solutions
    self%checks = self%checks + other%checks
    self%deviation = max(self%deviation, other%deviation)
  end subroutine add

  !> Text with the number of points for each verdict.
  pure function tally(self) result(words)
    class(summary_type), intent(in) :: self
    character(len=:), allocatable :: words
    type(verdict_count_type), allocatable :: counts(:)
    integer :: i

    words = ""
    counts = self%verdict_counts()
    do i = 1, size(counts)
      if (i > 1) words = words // ", "
      words = words // integer_text(counts(i)%points) // " " // trim(counts(i)%verdict%word())
    end do
  end function tally

end module gestell_task_sweep_summary
