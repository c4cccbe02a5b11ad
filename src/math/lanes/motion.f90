!> Applies a sequence of affine maps to several vectors side by side, as in gestell_math_lanes.
module gestell_math_lanes_motion
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_lanes_versions, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: apply_in_turn

contains

  !> Body of `apply_in_turn`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine apply_here(n, columns, room, first, steps, groups, maps, forced, most, motion, done, once) &
    & bind(C, name="lanes_gestell_apply")
    !$omp declare simd uniform(n, columns, room, first, steps, groups, maps, forced, most, motion, done) &
    !$omp& linear(once) simdlen(2) notinbranch
    integer(c_int), value :: n, columns, room, first, steps, groups, once
    real(dp), intent(in) :: maps(room, n, columns), forced(lanes)
    real(dp), value :: most
    real(dp), intent(inout) :: motion(lanes, n, groups, 0:steps)
    integer(c_int), intent(inout) :: done
    real(dp), dimension(lanes) :: load, sizes, s1, s2, s3
    integer :: lane, i, i2, i3, j, k, group, at

    sizes = 0
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    do k = 1, steps
      sizes = 0
      at = first + k - 1
      do group = 1, groups
        load = 0
        if (group == groups) load = forced
        ! Three rows at a time, so that no sum waits for its own last addition. If fewer rows remain, the last one is computed
        ! repeatedly.
        do i = 1, n, 3
          i2 = min(i + 1, n)
          i3 = min(i + 2, n)
          s1 = 0
          s2 = 0
          s3 = 0
          do j = 1, n
            !GCC$ unroll 1
            do lane = 1, lanes
              s1(lane) = s1(lane) + maps(at, i, j) * motion(lane, j, group, k - 1)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              s2(lane) = s2(lane) + maps(at, i2, j) * motion(lane, j, group, k - 1)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              s3(lane) = s3(lane) + maps(at, i3, j) * motion(lane, j, group, k - 1)
            end do
          end do
          !GCC$ unroll 1
          do lane = 1, lanes
            s1(lane) = s1(lane) + maps(at, i, columns) * load(lane)
            s2(lane) = s2(lane) + maps(at, i2, columns) * load(lane)
            s3(lane) = s3(lane) + maps(at, i3, columns) * load(lane)
            motion(lane, i, group, k) = s1(lane)
            motion(lane, i2, group, k) = s2(lane)
            motion(lane, i3, group, k) = s3(lane)
            sizes(lane) = sizes(lane) + abs(s1(lane)) + abs(s2(lane)) + abs(s3(lane))
          end do
        end do
      end do
      if (.not. all(sizes < most)) exit
      done = k
    end do
  end subroutine apply_here

  !> Applies the affine maps x <- A x + b of `steps` successive steps to all vectors.
  pure subroutine apply_in_turn(n, columns, room, first, steps, groups, maps, forced, most, motion, done)
    !> `n`: number of states. `columns`: number of columns of a map. `room`: first extent of `maps`. `first`: number of the first
    !> map. `steps`: number of steps. `groups`: number of groups; a group contains as many vectors as there are lanes.
    integer, intent(in) :: n, columns, room, first, steps, groups
    !> `maps`: maps [A b], or A alone, shape (room, n, columns). `forced`: 1 in the lanes of the last group to which b is added, 0
    !> in its other lanes. `most`: limit on the sum of absolute values in a lane.
    real(dp), intent(in) :: maps(room, n, columns), forced(lanes), most
    !> The vectors before the first step and after each step, shape (lanes, n, groups, 0:steps)
    real(dp), intent(inout) :: motion(lanes, n, groups, 0:steps)
    !> Number of successive steps for which the sum of absolute values in every lane remains below `most`
    integer, intent(out) :: done
    procedure(apply_here), bind(C, name="_ZGVeN2uuuuuuuuuuul_lanes_gestell_apply") :: apply_512
    procedure(apply_here), bind(C, name="_ZGVdN2uuuuuuuuuuul_lanes_gestell_apply") :: apply_256

    done = 0
    if (has_versions .and. vector_length() == 8) then
      call apply_512(n, columns, room, first, steps, groups, maps, forced, most, motion, done, 1)
    else if (has_versions .and. vector_length() == 4) then
      call apply_256(n, columns, room, first, steps, groups, maps, forced, most, motion, done, 1)
    else
      call apply_here(n, columns, room, first, steps, groups, maps, forced, most, motion, done, 1)
    end if
  end subroutine apply_in_turn

end module gestell_math_lanes_motion
