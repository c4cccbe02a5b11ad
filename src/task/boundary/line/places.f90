!> Where on a line two multipliers meet: there may be a tongue.
module gestell_task_boundary_line_places
  use gestell_base_kinds, only: dp, pi
  use gestell_task_boundary_line_exponents, only: stretch_type
  use gestell_task_boundary_line_pair, only: pair_name_type
  implicit none (type, external)
  private

  public :: fastest_within, meetings_on

  !> A place where two multipliers meet: the stretch, the place on it (0 to 1), and how fast their phases part.
  type, public :: place_type
    integer :: stretch = 0
    type(pair_name_type) :: name
    real(dp) :: x = 0, rate = 0
  end type place_type

  !> The places on one stretch.
  type, public :: places_type
    type(place_type), allocatable :: list(:)
  end type places_type

contains

  !> A rate that at most `most` of the places do not exceed: over the speed the slowest have the lowest orders, and so the widest
  !> tongues.
  pure real(dp) function fastest_within(places, most) result(rate)
    type(place_type), intent(in) :: places(:)
    integer, intent(in) :: most
    integer, parameter :: halvings = 60
    real(dp) :: high, middle
    integer :: k

    rate = huge(rate)
    if (size(places) <= most) return
    associate (rates => abs(places%rate))
      rate = 0
      high = maxval(rates)
      do k = 1, halvings
        middle = (rate + high) / 2
        if (count(rates <= middle) <= most) then
          rate = middle
        else
          high = middle
        end if
      end do
    end associate
  end function fastest_within

  !> The meetings of all pairs of multipliers on a stretch, `number` of the way; of two conjugate pairs those of one.
  pure function meetings_on(stretch, number) result(places)
    type(stretch_type), intent(in) :: stretch
    integer, intent(in) :: number
    type(place_type), allocatable :: places(:)
    integer, parameter :: samples = 16
    !> In radians: how far multipliers may pass by each other to be searched, beside the error of where they are; how far they may
    !> lie below the real axis (sine of the argument); up to which difference they count as one.
    real(dp), parameter :: close = 0.02_dp, below = -0.2_dp, locked = 1.0e-9_dp, safety = 4
    !> No meeting stops a decay so strong (ln |rho|) without these curves showing it.
    real(dp), parameter :: strong = -3
    complex(dp) :: z(size(stretch%miss), 0:samples)
    real(dp) :: ahead(0:samples), rest(0:samples), near, x
    integer :: i, j, k, turns
    logical :: meets(samples)

    allocate(places(0))
    do k = 0, samples
      z(:, k) = stretch%at(real(k, dp) / samples)
    end do
    do i = 1, size(z, 1)
      do j = i + 1, size(z, 1)
        if (any(maxval(real(z([i, j], :)), dim=2) < strong)) cycle
        ahead = aimag(z(i, :) - z(j, :))
        near = close + safety * (abs(stretch%miss(i)) + abs(stretch%miss(j)))
        do turns = floor((minval(ahead) - near) / (2 * pi)), ceiling((maxval(ahead) + near) / (2 * pi))
          rest = ahead - 2 * pi * turns
          if (minval(abs(rest)) > near .and. all(rest > 0 .eqv. rest(0) > 0)) cycle
          if (maxval(abs(rest)) <= locked) cycle
          ! Where the phases meet; where they nowhere do, once where they are nearest to each other.
          meets = (rest(1:) > 0) .neqv. (rest(:samples - 1) > 0)
          if (.not. any(meets)) meets(max(minloc(abs(rest), dim=1) - 1, 1)) = .true.
          do k = 1, samples
            if (.not. meets(k) .or. sin(aimag(z(j, k))) < below) cycle
            associate (a => rest(k - 1), b => rest(k))
              x = merge(0, 1, abs(a) < abs(b))
              if ((a > 0) .neqv. (b > 0)) x = a / (a - b)
              places = [places, place_type(number, pair_name_type(i, j, turns), (k - 1 + x) / samples, &
                & (b - a) * samples / stretch%length())]
            end associate
          end do
        end do
      end do
    end do
  end function meetings_on

end module gestell_task_boundary_line_places
