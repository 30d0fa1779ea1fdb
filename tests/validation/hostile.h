/* What an FMU may do to its host, by name. Each ends by itself after a minute or two, should nobody
 * end it. Not for Windows. */
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void linger(void) {
    for (int i = 0; i < 1200; i++)
        usleep(100000);
    _exit(0);
}

static void ignore_signals(void) {
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, NULL);
    for (int number = 1; number < 65; number++)
        signal(number, SIG_IGN);
}

static void close_all(void) {
    for (int file = 0; file < 4096; file++)
        close(file);
}

/* A process of a session and a parent of its own, which keeps every pipe that it inherits. */
static void leave_daemon(void) {
    if (fork() == 0) {
        setsid();
        if (fork() == 0) {
            ignore_signals();
            linger();
        }
        _exit(0);
    }
}

/* One that is another process every 20 ms. */
static void leave_hopper(void) {
    if (fork() == 0) {
        setsid();
        for (int i = 0; i < 3000; i++) {
            if (fork() != 0)
                _exit(0);
            usleep(20000);
        }
        _exit(0);
    }
    usleep(100000);
}

static void litter(void) {
    const char *folder = getenv("TMPDIR");
    char path[1024];
    fclose(fopen("here.txt", "w"));
    snprintf(path, sizeof path, "%s/locked", folder ? folder : "/tmp");
    mkdir(path, 0700);
    size_t length = strlen(path);
    strcpy(path + length, "/file");
    fclose(fopen(path, "w"));
    path[length] = 0;
    chmod(path, 0);
}

static void go_deeper(void) {
    static int depth;
    for (; depth < 1100; depth++)
        if (mkdir("folder", 0700) || chdir("folder"))
            return;
}

/* Processes that hold the same memory. */
static void share(void) {
    static char *block;
    if (block)
        return;
    block = memset(malloc(200 << 20), 1, 200 << 20);
    for (int i = 0; i < 4; i++)
        if (fork() == 0)
            usleep(600000), _exit(0);
    usleep(700000);
}

static void answer_in_brackets(void) {
    static char brackets[100000];
    memset(brackets, '[', sizeof brackets - 1);
    brackets[sizeof brackets - 1] = '\n';
    for (int file = 3; file < 32; file++)
        if (write(file, brackets, sizeof brackets) < 0)
            continue;
}

static void misbehave(const char *how) {
#define IS(name) (strcmp(how, name) == 0)
    if (IS("prints"))
        for (;;)
            puts("all work and no play makes a dull FMU");
    if (IS("prints-one-line"))
        for (;;)
            fputs("and on ", stderr);
    if (IS("prints-controls")) {
        fputs("\033[2J\033]0;owned\007\x9b"
              "31mred\r\b\xff\xfe\n",
              stderr);
        _exit(3);
    }
    if (IS("forks-crashes") || IS("forks-hangs")) {
        if (fork() == 0)
            linger();
        if (IS("forks-crashes"))
            raise(SIGSEGV);
        linger();
    }
    if (IS("daemon"))
        leave_daemon();
    if (IS("daemon-crashes")) {
        leave_daemon();
        usleep(50000);
        raise(SIGSEGV);
    }
    if (IS("hopper-crashes")) {
        leave_hopper();
        raise(SIGSEGV);
    }
    if (IS("stops"))
        raise(SIGSTOP);
    if (IS("stops-group"))
        kill(0, SIGSTOP);
    if (IS("closes"))
        close_all();
    if (IS("closes-stops"))
        close_all(), raise(SIGSTOP);
    if (IS("closes-forks-stops")) {
        close_all();
        if (fork() == 0)
            raise(SIGSTOP);
        raise(SIGSTOP);
    }
    if (IS("exits"))
        _exit(0);
    if (IS("crashes"))
        *(volatile int *)8 = 1;
    if (IS("sleeps"))
        sleep(120);
    if (IS("deaf"))
        ignore_signals(), linger();
    if (IS("spins"))
        for (volatile long i = 0;; i++)
            ;
    if (IS("allocates"))
        for (;;) {
            char *block = malloc(1 << 24);
            for (int i = 0; block && i < 1 << 24; i += 512)
                *(volatile char *)(block + i) = 1;
        }
    if (IS("kills-parent"))
        kill(getppid(), SIGKILL), linger();
    if (IS("kills-parent-stops"))
        kill(getppid(), SIGKILL), raise(SIGSTOP);
    if (IS("kills-parent-daemon"))
        leave_daemon(), usleep(50000), kill(getppid(), SIGKILL), linger();
    if (IS("stops-parent"))
        leave_daemon(), usleep(50000), kill(getppid(), SIGSTOP), linger();
    if (IS("interrupts"))
        raise(SIGINT);
    if (IS("reads"))
        while (getchar() != EOF)
            ;
    if (IS("answers"))
        for (int file = 3; file < 32; file++)
            if (write(file, "{\"answer\": 1}\nnone\n", 19) < 0)
                continue;
    if (IS("answers-brackets"))
        answer_in_brackets();
    if (IS("deepens"))
        go_deeper();
    if (IS("shares"))
        share();
    if (IS("litters"))
        litter();
}
