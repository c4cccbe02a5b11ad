!> Defines the keys of the input group &balance.
module gestell_task_balance_keys
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, of_length, positive, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_type, has, group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_schema_units, only: units_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: read_balance

  !> Maximum number of links in the key `links`
  integer, parameter :: most_links = 20

  type(key_type), parameter, public :: balance_keys(*) = [ &
    & key_type("balance", "links", text_key, "names of the links that may carry counterweights", 1, 1, most_links, &
    &   otherwise="all links that rotate"), &
    & key_type("balance", "radius", real_key, "distance of a counterweight from its link's pivot on the frame, or from joint " // &
    &   "`from` if there is no such pivot; one value for all links, or one for each link in `links`", 1, 1, most_links, &
    &   unit=of_length, range=positive, otherwise="length of the link: distance from joint `from` to joint `to`"), &
    & key_type("balance", "weight", real_key, "factor in the weighted sum (1 - `weight`) force^2 + `weight` " // &
    &   "(moment/`length`)^2 of rms values", default=0.5_dp, range=range_type(0.0_dp, 1.0_dp)), &
    & key_type("balance", "length", real_key, "length by which moments are divided in the weighted sum of force and moment", &
    &   unit=of_length, range=positive, otherwise="rms moment divided by rms force, without counterweights"), &
    & key_type("balance", "about", text_key, "reference point of moments on rigid ground: `'frame'`, the frame's centre of " // &
    &   "mass F, as for the quantity `m`; or `'origin'`, the mechanism's origin O", word="frame", words="frame, origin")]

  !> Values of the keys of the group &balance, in SI units.
  type, public :: balance_options
    !> Indices of the links that may carry counterweights; if not allocated, all links may
    integer, allocatable :: links(:)
    !> Radii of the counterweights (m); if not allocated, the lengths of the links are used
    real(dp), allocatable :: radii(:)
    !> Factor of the moment in the sum (1 - `weight`) F^2 + `weight` (M / `length`)^2, which some counterweights minimise. F and M
    !> are the rms force and the rms moment on rigid ground. `weight` lies between 0 and 1
    real(dp) :: weight = 0.5_dp
    !> Length (m) by which the moment is divided when force and moment are added. 0: use the rms moment of the original machine
    !> divided by its rms force
    real(dp) :: length = 0
    !> Reference point of moments on rigid ground. True: the frame's centre of mass F. False: the mechanism's origin O
    logical :: about_frame = .true.
  end type balance_options

contains

  !> Reads the group &balance for a linkage. Fails if a value is out of range, or if a link does not exist, does not rotate or is
  !> named twice. Fails also if the number of radii is neither 1 nor the number of links.
  subroutine read_balance(doc, units, linkage, options, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    class(linkage_type), intent(in) :: linkage
    type(balance_options), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=:), allocatable :: about

    group = group_named(doc, "balance")
    call read(group, balance_keys, "weight", options%weight, error)
    if (.not. allocated(error)) call read(group, balance_keys, "about", about, error)
    if (allocated(error)) return
    options%about_frame = about == "frame"
    if (has(group, "length")) call read(group, balance_keys, "length", options%length, error, units)
    if (.not. allocated(error)) call read_links(group, linkage, options, error)
    if (allocated(error) .or. .not. has(group, "radius")) return
    allocate(options%radii(count_values(group, "radius")))
    call read(group, balance_keys, "radius", options%radii, error, units)
    if (allocated(error) .or. size(options%radii) == 1) return
    if (.not. allocated(options%links)) then
      call input_error(group, "radius", "has several values, but the key 'links' is missing: give one value, or name the " &
        & // "links", error)
    else if (size(options%radii) /= size(options%links)) then
      call input_error(group, "radius", "must have one value, or one for each link in 'links'", error)
    end if
  end subroutine read_balance

  !> Reads the names of the links, and finds the index of each.
  subroutine read_links(group, linkage, options, error)
    type(group_type), intent(in) :: group
    class(linkage_type), intent(in) :: linkage
    type(balance_options), intent(inout) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: names(:)
    integer :: i, k

    if (.not. has(group, "links")) return
    call read(group, balance_keys, "links", names, error)
    if (allocated(error)) return
    allocate(options%links(size(names)))
    do i = 1, size(names)
      options%links(i) = findloc([(linkage%links(k)%name == names(i), k = 1, size(linkage%links))], .true., dim=1, back=.true.)
      if (options%links(i) == 0) then
        call input_error(group, "links", "there is no link '" // trim(names(i)) // "'", error, i)
      else if (linkage%links(options%links(i))%to == 0) then
        call input_error(group, "links", "'" // trim(names(i)) // "' cannot carry a counterweight: it has no key 'to', so it " &
          & // "does not rotate", error, i)
      else if (any(options%links(:i - 1) == options%links(i))) then
        call input_error(group, "links", "link '" // trim(names(i)) // "' is named twice", error, i)
      end if
      if (allocated(error)) return
    end do
  end subroutine read_links

end module gestell_task_balance_keys
