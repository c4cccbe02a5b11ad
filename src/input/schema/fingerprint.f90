!> Computes a hash of the content of an input, which does not depend on the input's layout.
module gestell_input_schema_fingerprint
  use gestell_base_files, only: read_file
  use gestell_base_paths, only: is_absolute
  use gestell_base_hash, only: hash_start, mix, mix_text
  use gestell_input_namelist_document, only: document_type, find_entry, group_type
  use gestell_base_key, only: text_key
  use gestell_input_schema, only: schema_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: content_hash

contains

  !> Hash of the groups, keys and values of a checked document; it includes values set by --set. It does not depend on the order of
  !> the keys in a group, the order of groups with different names, or the notation of the numbers. Of files that the input names,
  !> the content counts.
  integer(int64) function content_hash(doc, schema) result(hash)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    integer :: i, k

    hash = hash_start
    do k = 1, size(schema%groups)
      do i = 1, size(doc%groups)
        if (doc%groups(i)%name /= schema%groups(k)%name) cycle
        call mix_text(hash, doc%groups(i)%name)
        call mix_group(hash, doc%groups(i), schema)
      end do
    end do
  end function content_hash

  subroutine mix_group(hash, group, schema)
    integer(int64), intent(inout) :: hash
    type(group_type), intent(in) :: group
    type(schema_type), intent(in) :: schema
    character(len=:), allocatable :: bytes, file
    integer :: k, e, v

    do k = 1, size(schema%keys)
      if (schema%keys(k)%group /= group%name) cycle
      e = find_entry(group, trim(schema%keys(k)%name))
      if (e == 0) cycle
      call mix_text(hash, group%entries(e)%key)
      do v = 1, size(group%entries(e)%values)
        associate (value => group%entries(e)%values(v))
          if (.not. allocated(value%text)) then
            call mix_text(hash, "")
          else if (schema%keys(k)%kind == text_key) then
            call mix_text(hash, value%text)
            if (schema%keys(k)%group == "load" .and. schema%keys(k)%name == "table") then
              file = value%text
              if (.not. is_absolute(file)) file = group%file(:index(group%file, "/", back=.true.)) // file
              call read_file(file, bytes)
              call mix_text(hash, bytes)
            end if
          else
            call mix(hash, [transfer(value%number, hash)])
          end if
        end associate
      end do
    end do
  end subroutine mix_group

end module gestell_input_schema_fingerprint
