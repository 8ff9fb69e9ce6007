/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* Preloaded (LD_PRELOAD): throws away a part of the datagrams that a process sends. The file that
 * LOSSY_FILE names holds that part as a float, 0 to 1, and may change at any time. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

static const volatile float *part;
static pthread_once_t once = PTHREAD_ONCE_INIT;
static __thread uint64_t state;

static void look(void)
{
    const char *path = getenv("LOSSY_FILE");
    int file = path ? open(path, O_RDONLY) : -1;
    if (file < 0)
        return;
    void *map = mmap(0, sizeof *part, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    if (map != MAP_FAILED)
        part = map;
}

static int lost(int socket)
{
    int kind;
    socklen_t size = sizeof kind;
    pthread_once(&once, look);
    if (!part || *part <= 0.0f
        || getsockopt(socket, SOL_SOCKET, SO_TYPE, &kind, &size) || kind != SOCK_DGRAM)
        return 0;
    if (!state)
        state = (uint64_t)(uintptr_t)&state ^ ((uint64_t)getpid() << 32) | 1;
    state ^= state << 13;   /* xorshift64 */
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53 < *part;
}

ssize_t sendmsg(int socket, const struct msghdr *message, int flags)
{
    static ssize_t (*next)(int, const struct msghdr *, int);
    if (!next)
        next = dlsym(RTLD_NEXT, "sendmsg");
    if (lost(socket)) {
        size_t size = 0;
        for (size_t index = 0; index < message->msg_iovlen; index++)
            size += message->msg_iov[index].iov_len;
        return (ssize_t)size;
    }
    return next(socket, message, flags);
}

ssize_t sendto(int socket, const void *data, size_t size, int flags,
               const struct sockaddr *address, socklen_t length)
{
    static ssize_t (*next)(int, const void *, size_t, int, const struct sockaddr *, socklen_t);
    if (!next)
        next = dlsym(RTLD_NEXT, "sendto");
    return lost(socket) ? (ssize_t)size : next(socket, data, size, flags, address, length);
}
