!> Solves the equations of one iteration of gestell_floquet_reduction_decoupling at all phases together, in real form.
module gestell_floquet_reduction_separation
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_conjugates, only: add_entry, counts, divide, entry
  use gestell_floquet_reduction_equations, only: equations_type, means
  use gestell_floquet_reduction_modes, only: columns_of, modes_type
  use gestell_floquet_reduction_phasewise, only: solve
  implicit none (type, external)
  private

  public :: min_distance, separation

contains

  !> Solves D_g Z_gh - Z_gh D_h = -D_gh for all pairs of groups g, h; within groups Z is zero. `d` and `z` have the shape
  !> (phases, n, n). Fails if two groups share an eigenvalue.
  subroutine separation(d, modes, z, error)
    !> D at the phases
    real(dp), contiguous, intent(in) :: d(:, :, :)
    type(modes_type), intent(in) :: modes
    real(dp), contiguous, intent(out) :: z(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    logical :: single(size(modes%group))
    real(dp), dimension(size(d, 1)) :: re, im, distance_re, distance_im
    real(dp), dimension(size(d, 1), size(d, 2)) :: own_re, own_im
    integer :: g, h, k, l

    z = 0
    do k = 1, size(single)
      single(k) = count(modes%group == modes%group(k)) == 1
      call entry(d, modes%conjugate, k, k, own_re(:, k), own_im(:, k))
    end do
    do k = 1, size(single)
      do l = 1, size(single)
        if (k == l .or. .not. (single(k) .and. single(l) .and. counts(modes%conjugate, k, l))) cycle
        distance_re = own_re(:, l) - own_re(:, k)
        distance_im = own_im(:, l) - own_im(:, k)
        call entry(d, modes%conjugate, k, l, re, im)
        call divide(distance_re, distance_im, re, im, error)
        if (allocated(error)) return
        call add_entry(re, im, modes%conjugate, k, l, z)
      end do
    end do
    if (all(single)) return
    do g = 0, size(single)
      do h = 0, size(single)
        associate (own => columns_of(modes%group, g), others => columns_of(modes%group, h))
          if (g == h .or. size(own) * size(others) < 2) cycle
          call separate_groups(d, modes%conjugate, own, others, z, error)
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine separation

  !> Solves D_g Z_gh - Z_gh D_h = -D_gh for two groups g, h, of which one or both have several modes. The equation has the form A
  !> X - X B = C. It is solved as a system of linear equations for the elements of X, column by column. Every equation is divided
  !> by the distance between the mean eigenvalues of the groups.
  subroutine separate_groups(d, conjugate, own, others, z, error)
    real(dp), contiguous, intent(in) :: d(:, :, :)
    integer, intent(in) :: conjugate(:), own(:), others(:)
    real(dp), contiguous, intent(inout) :: z(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(equations_type) :: equations
    real(dp), dimension(size(d, 1)) :: re, im, mean_re, mean_im
    integer :: m, i, j, k, row

    m = size(own)
    allocate(equations%re(size(d, 1)), equations%im(size(d, 1)))
    call means(d, conjugate, own, equations%re, equations%im)
    call means(d, conjugate, others, mean_re, mean_im)
    equations%re = equations%re - mean_re
    equations%im = equations%im - mean_im
    call equations%start(m * size(others))
    do j = 1, size(others)
      do i = 1, m
        row = i + m * (j - 1)
        do k = 1, m
          call entry(d, conjugate, own(i), own(k), re, im)
          call equations%add(re, im, row, k + m * (j - 1))
        end do
        do k = 1, size(others)
          call entry(d, conjugate, others(k), others(j), re, im)
          call equations%add(-re, -im, row, i + m * (k - 1))
        end do
        call entry(d, conjugate, own(i), others(j), re, im)
        call equations%set_right(-re, -im, row)
      end do
    end do
    call solve(equations%matrix, equations%x, error)
    if (allocated(error)) return
    do j = 1, size(others)
      do i = 1, m
        row = i + m * (j - 1)
        if (counts(conjugate, own(i), others(j))) call add_entry(equations%x(:, row), equations%x(:, equations%n + row), &
          & conjugate, own(i), others(j), z)
      end do
    end do
  end subroutine separate_groups

  !> Lower bound on the minimum distance over all phases between two groups, or between a fast group and zero. Each group is
  !> represented by a disc that contains all its eigenvalues and has their mean as its centre.
  pure real(dp) function min_distance(d, modes)
    real(dp), contiguous, intent(in) :: d(:, :, :)
    type(modes_type), intent(in) :: modes
    real(dp), dimension(size(d, 1), 0:size(modes%group)) :: centre_re, centre_im, radius
    real(dp), dimension(size(d, 1)) :: re, im
    integer :: g, h, k, l, members

    centre_re = 0
    centre_im = 0
    radius = 0
    do k = 1, size(modes%group)
      g = modes%group(k)
      if (g == 0) cycle
      members = count(modes%group == g)
      call entry(d, modes%conjugate, k, k, re, im)
      centre_re(:, g) = centre_re(:, g) + re / members
      centre_im(:, g) = centre_im(:, g) + im / members
    end do
    do k = 1, size(modes%group)
      g = modes%group(k)
      if (g > 0 .and. count(modes%group == g) == 1) cycle
      do l = 1, size(modes%group)
        if (modes%group(l) /= g) cycle
        call entry(d, modes%conjugate, k, l, re, im)
        if (k == l) then
          re = re - centre_re(:, g)
          im = im - centre_im(:, g)
        end if
        radius(:, g) = radius(:, g) + re**2 + im**2
      end do
    end do
    radius = sqrt(radius)
    min_distance = huge(min_distance)
    do g = 1, size(modes%group)
      if (.not. any(modes%group == g)) cycle
      do h = 0, g - 1
        if (h > 0 .and. .not. any(modes%group == h)) cycle
        re = sqrt((centre_re(:, g) - centre_re(:, h))**2 + (centre_im(:, g) - centre_im(:, h))**2) - radius(:, g) - radius(:, h)
        min_distance = min(min_distance, minval(re))
      end do
    end do
  end function min_distance

end module gestell_floquet_reduction_separation
