!> Represents the motion over a period as a list of numbers. The period is divided into parts. Phases of vibrations change less
!> within a part than within the whole period, so the series in the parameters need fewer terms. For part k the list contains two
!> kinds of numbers, in balanced units. The first kind describes the map of the state over the part, x -> A_k x + b_k. The second
!> kind describes the maps from the state at the beginning of the part to the positions at times within it. b_k exists if the
!> periodic vibration is requested; it has a unit of its own.
!>
!> An error dA of A_k changes the state at the beginning of part j by A_(j-1) ... A_(k+1) dA x_k, where x_k is the state at the
!> beginning of part k. Each number of part k is therefore multiplied by a weight: the product of the norms of A_(j-1) ... A_(k+1)
!> and of x_k. Errors and omitted terms of a series then count by their effect on the motion.
module gestell_task_sweep_expansion_parts
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_math_lanes_products, only: multiply
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  !> Structure and weights of the list of numbers that represent the motion. The period is divided into parts. For each part k the
  !> list contains two kinds of numbers. First come the rows of [A_k b_k], the map of the state x -> A_k x + b_k over the part.
  !> Then come the rows of the maps to the positions at each of the `between` times within the part. Column b_k exists only if
  !> `forced` is true.
  type, public :: parts_type
    !> `states`: number of states. `parts`: number of parts of the period. `between`: number of times within a part at which
    !> positions are computed.
    integer :: states = 0, parts = 1, between = 0
    logical :: forced = .false.
    !> Weights of the elements of the list of numbers, one for each part of the period, shape (parts). They scale the elements so
    !> that errors count by their effect on the motion. `of_map`: weights of the elements of [A_k b_k]. `of_times`: weights of the
    !> rows for positions at times within the part.
    real(dp), allocatable :: of_map(:), of_times(:)
  contains
    procedure :: columns, numbers, numbers_of_period, map_at, times_at, set_weights, weighted, period, phi, reach, compose
  end type parts_type

contains

  !> Number of columns of the map [A_k b_k] of a part: one for each state, and the column b_k if `forced` is true.
  pure integer function columns(self)
    class(parts_type), intent(in) :: self

    columns = self%states + merge(1, 0, self%forced)
  end function columns

  !> Length of the list of numbers that represent the motion.
  pure integer function numbers(self)
    class(parts_type), intent(in) :: self

    numbers = self%times_at(self%parts + 1, 1) - 1 - self%states * self%columns()
  end function numbers

  !> Number of elements of the monodromy matrix Phi(T) and, if `forced` is true, of the motion x_p(T), which is forced from rest.
  pure integer function numbers_of_period(self)
    class(parts_type), intent(in) :: self

    numbers_of_period = self%states * self%columns()
  end function numbers_of_period

  !> Index, in the list, of the first number that belongs to the map of a part.
  pure integer function map_at(self, part)
    class(parts_type), intent(in) :: self
    integer, intent(in) :: part

    map_at = self%times_at(part, 1) - self%states * self%columns()
  end function map_at

  !> Index, in the list, of the first number that belongs to a time within a part.
  pure integer function times_at(self, part, time)
    class(parts_type), intent(in) :: self
    integer, intent(in) :: part, time

    times_at = 1 + self%columns() * (part * self%states + ((part - 1) * self%between + time - 1) * (self%states / 2))
  end function times_at

  !> Computes the weights from numbers that are not yet weighted, shape (numbers, samples).
  pure subroutine set_weights(self, values)
    class(parts_type), intent(inout) :: self
    real(dp), intent(in) :: values(:, :)
    real(dp), dimension(self%parts) :: of_map, of_times
    integer :: k

    self%of_map = 0
    self%of_times = 0
    do k = 1, size(values, 2)
      call find_weights(self, values(:, k), of_map, of_times)
      self%of_map = max(self%of_map, of_map)
      self%of_times = max(self%of_times, of_times)
    end do
  end subroutine set_weights

  !> Multiplies the list of numbers that represent the motion by the weights; shape (numbers).
  pure function weighted(self, values)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    real(dp) :: weighted(size(values))
    integer :: k

    do k = 1, self%parts
      associate (at => self%map_at(k), next => self%times_at(k, 1), last => self%map_at(k + 1) - 1)
        weighted(at:next - 1) = self%of_map(k) * values(at:next - 1)
        weighted(next:last) = self%of_times(k) * values(next:last)
      end associate
    end do
  end function weighted

  !> Computes the monodromy matrix Phi(T), column by column, and the motion x_p(T) forced from rest; shape (numbers_of_period).
  !> `values`: weighted numbers that represent the motion.
  pure function period(self, values)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    real(dp) :: period(self%numbers_of_period()), motion(self%states, self%columns())
    integer :: k

    motion = unit_motion(self)
    do k = 1, self%parts
      motion = moved(self, map_of(self, k, values) / self%of_map(k), motion)
    end do
    period = reshape(motion, [size(motion)])
  end function period

  !> Monodromy matrix Phi(T), computed from weighted numbers; shape (states, states).
  pure function phi(self, values)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    real(dp) :: phi(self%states, self%states)

    associate (period => self%period(values))
      phi = reshape(period(:size(phi)), shape(phi))
    end associate
  end function phi

  !> Factor (at least 1) by which the weights are too small for the given weighted numbers.
  pure real(dp) function reach(self, values)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    real(dp), dimension(self%parts) :: of_map, of_times
    type(parts_type) :: without
    integer :: k

    without = self
    without%of_map = 1 / self%of_map
    without%of_times = 1 / self%of_times
    call find_weights(self, without%weighted(values), of_map, of_times)
    reach = 1
    do k = 1, self%parts
      reach = max(reach, of_map(k) / self%of_map(k))
      if (self%between > 0) reach = max(reach, of_times(k) / self%of_times(k))
    end do
  end function reach

  !> Computes the weights for given numbers that are not weighted.
  pure subroutine find_weights(self, values, of_map, of_times)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    real(dp), intent(out) :: of_map(:), of_times(:)
    real(dp) :: maps(self%states, self%columns(), self%parts), before(self%states, self%columns()), after(self%states, self%states)
    integer :: k

    do k = 1, self%parts
      maps(:, :, k) = map_of(self, k, values)
    end do
    after = unit_matrix(self%states)
    do k = self%parts, 1, -1
      if (self%forced) then
        of_map(k) = max_amplification(self%states, maps(:, :, k + 1:))
      else
        of_map(k) = norm_bound(after)
        after = matmul(after, maps(:, :self%states, k))
      end if
    end do
    before = unit_motion(self)
    do k = 1, self%parts
      of_times(k) = hypot(norm_bound(before), merge(1.0_dp, 0.0_dp, self%forced))
      of_map(k) = max(of_map(k) * of_times(k), tiny(1.0_dp))
      before = moved(self, maps(:, :, k), before)
    end do
    ! The division by the root makes norms over few times comparable with norms over many times.
    of_times = max(of_times, tiny(1.0_dp)) / sqrt(real(self%parts * self%between + 1, dp))
  end subroutine find_weights

  !> Bound on the largest norm that a state of norm 1 can have before or after any of the given maps, which are applied one after
  !> another. `n`: number of states.
  pure real(dp) function max_amplification(n, maps) result(maximum)
    integer, intent(in) :: n
    real(dp), intent(in) :: maps(:, :, :)
    real(dp) :: after(n, n)
    integer :: j

    maximum = 1
    after = unit_matrix(n)
    do j = 1, size(maps, 3)
      after = matmul(maps(:, :n, j), after)
      maximum = max(maximum, norm_bound(after))
    end do
  end function max_amplification

  !> Upper bound on the spectral norm |M|. It exceeds |M| at most by the factor (number of rows times number of columns)^(1/4). It
  !> is equal to 1 for the unit matrix.
  pure real(dp) function norm_bound(matrix)
    real(dp), intent(in) :: matrix(:, :)

    norm_bound = sqrt(maxval(sum(abs(matrix), dim=1)) * maxval(sum(abs(matrix), dim=2)))
  end function norm_bound

  !> The motion [E 0] at the start of the period: the unit matrix E as the transition matrix, and the state 0.
  pure function unit_motion(self) result(motion)
    class(parts_type), intent(in) :: self
    real(dp) :: motion(self%states, self%columns())

    motion = 0
    motion(:, :self%states) = unit_matrix(self%states)
  end function unit_motion

  pure function map_of(self, part, values) result(map)
    class(parts_type), intent(in) :: self
    integer, intent(in) :: part
    real(dp), intent(in) :: values(:)
    real(dp) :: map(self%states, self%columns())

    associate (at => self%map_at(part))
      map = transpose(reshape(values(at:at + size(map) - 1), [size(map, 2), size(map, 1)]))
    end associate
  end function map_of

  !> Applies the map [A b] of a part to `motion` = [Phi x], where Phi is the transition matrix and x the forced response that
  !> starts from rest. The result is [A Phi, A x + b].
  pure function moved(self, map, motion)
    class(parts_type), intent(in) :: self
    real(dp), intent(in) :: map(:, :), motion(:, :)
    real(dp) :: moved(self%states, self%columns())

    associate (n => self%states)
      moved = matmul(map(:, :n), motion)
      moved(:, n + 1:) = moved(:, n + 1:) + map(:, n + 1:)
    end associate
  end function moved

  !> Computes the transition matrix Phi and the motion x_p forced from rest at the ends of all parts, for eight machines at once.
  !> `values`: weighted numbers of these machines, shape (lanes, numbers). `motion`: [Phi x_p], shape (lanes, states, columns,
  !> 0:parts).
  pure subroutine compose(self, values, motion)
    class(parts_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: values(:, :)
    real(dp), contiguous, intent(out) :: motion(:, :, :, 0:)
    integer :: length, n, columns, k, i, at

    length = vector_length()
    n = self%states
    columns = self%columns()
    motion(:, :, :, 0) = 0
    do i = 1, n
      motion(:, i, i, 0) = 1
    end do
    ! The first map acts on the matrix E and the state 0.
    do i = 1, n
      motion(:, i, :, 1) = values(:, columns * (i - 1) + 1:columns * i) / self%of_map(1)
    end do
    do k = 2, self%parts
      at = self%map_at(k)
      call multiply(length, n, columns, 1 / self%of_map(k), values(:, at:), motion(:, :, :, k - 1), motion(:, :, :, k))
      if (.not. self%forced) cycle
      motion(:, :, columns, k) = motion(:, :, columns, k) + values(:, at + n:at + columns * n - 1:columns) / self%of_map(k)
    end do
  end subroutine compose

end module gestell_task_sweep_expansion_parts
