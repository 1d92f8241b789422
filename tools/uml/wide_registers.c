/* User-Mode Linux 6.1 keeps 2696 bytes of a guest process's extended registers, which is all an AVX-512 host has. A host
 * with AMX has 11 kB of them and refuses a shorter write (EFAULT), so that the guest's init dies at its first instruction.
 * This library, preloaded into linux.uml, fills such a write up with zeros to the host's size: the missing part is the AMX
 * tile, which no process owns before it asks the kernel for it. Elsewhere it changes nothing. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

enum { LARGEST = 1 << 14 };

long ptrace(enum __ptrace_request request, ...)
{
    static long (*real)(int, ...);
    static size_t host_size;
    static char full[LARGEST];
    va_list list;
    va_start(list, request);
    long pid = va_arg(list, long);
    void *address = va_arg(list, void *), *data = va_arg(list, void *);
    va_end(list);
    if (!real)
        real = (long (*)(int, ...))dlsym(RTLD_NEXT, "ptrace");
    if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
        struct iovec *given = data, whole = {full, LARGEST};
        if (!host_size && real(PTRACE_GETREGSET, pid, address, &whole) == 0)
            host_size = whole.iov_len;
        if (given->iov_len < host_size) {
            memcpy(full, given->iov_base, given->iov_len);
            memset(full + given->iov_len, 0, host_size - given->iov_len);
            whole.iov_len = host_size;
            return real(request, pid, address, &whole);
        }
    }
    return real(request, pid, address, data);
}
