/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_gnuplot.c — the only file that runs gnuplot. */
#include "plot_gnuplot.h"
#include "show.h"
#include "plot.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { SERIES_POINTS = 6000 }; /* more would only make the files larger: 18 cm at 300 dpi are 2100 dots */

/* ---- Directory and names ---- */

static enum bf_status make_directory(const char *path, struct bf_error *err)
{
    char *part = bf_strdup(path);
    enum bf_status status = BF_OK;
    for (char *c = part + 1; status == BF_OK; c++) {
        if (*c != '/' && *c != '\0')
            continue;
        const char end = *c;
        *c = '\0';
        if (mkdir(part, 0777) != 0 && errno != EEXIST)
            status = bf_fail(err, BF_BAD_FILE, "%s: the directory cannot be made (%s); choose another for --plot", path,
                             strerror(errno));
        *c = end;
        if (end == '\0')
            break;
    }
    free(part);
    return status;
}

void picture_name(const char *from, char to[PICTURE_STEM])
{
    size_t n = 0;
    for (; *from != '\0' && n + 1 < PICTURE_STEM; from++) {
        const char c = *from;
        const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                          (n > 0 && (c == '.' || c == '-'));
        to[n++] = fine ? c : '_';
    }
    if (n == 0)
        to[n++] = '_';
    to[n] = '\0';
}

static char *join(const struct picture *p, const char *tail)
{
    const size_t size = strlen(p->directory) + strlen(p->stem) + strlen(tail) + 2;
    char *path = bf_alloc(size, 1);
    (void)snprintf(path, size, "%s/%s%s", p->directory, p->stem, tail);
    return path;
}

/* ---- Writing ---- */

static FILE *nowhere(void)
{
    static FILE *sink;
    if (sink == NULL)
        sink = fopen("/dev/null", "w");
    return sink != NULL ? sink : stderr;
}

static FILE *open_part(struct picture *p, const char *tail, struct atomic_file *file)
{
    if (p->error.status != BF_OK)
        return nowhere();
    char *path = join(p, tail);
    const enum bf_status status = atomic_open(path, file, &p->error);
    free(path);
    if (status == BF_OK)
        outputs_mark(file, "# ", "\n");
    return status == BF_OK ? file->f : nowhere();
}

static const char *const picture_tails[] = {".png", ".pdf"};

void picture_begin(const char *directory, const char *stem, double width_cm, double height_cm, struct picture *p)
{
    *p = (struct picture){.directory = bf_strdup(directory[0] != '\0' ? directory : ".")};
    picture_name(stem, p->stem);
    if (make_directory(p->directory, &p->error) == BF_OK)
        (void)picture_may_be_made(p->directory, p->stem, &p->error);
    p->script = open_part(p, ".gp", &p->script_file);
    (void)fprintf(
        p->script,
        "# Draws %s.png and %s.pdf from the data files beside it: gnuplot %s.gp\n"
        "set encoding utf8\n"
        "do for [kind in 'png pdf'] {\n"
        "reset\n"
        "if (kind eq 'png') { set terminal pngcairo enhanced size %.0f,%.0f font 'DejaVu Sans,21' linewidth 2 }\n"
        "if (kind eq 'pdf') { set terminal pdfcairo enhanced size %.2fcm,%.2fcm font 'DejaVu Sans,9' linewidth "
        "1.2 }\n"
        "dot = kind eq 'png' ? 0.7 : 0.3\n"
        "mark = kind eq 'png' ? 1.1 : 0.5\n"
        "set output '%s.'.kind\n"
        "set tics nomirror out scale 0.6\n"
        "set border 3 linewidth 0.8\n"
        "set grid back linetype 1 dashtype 1 linecolor rgb '#E6E6E6' linewidth 0.5\n"
        "set key noautotitle noenhanced samplen 2.2 spacing 1.05\n"
        "set format '%%h'\n"
        "set style fill solid 1.0 noborder\n",
        p->stem, p->stem, p->stem, width_cm * 100.0, height_cm * 100.0, width_cm, height_cm, p->stem);
}

FILE *picture_data(struct picture *p, const char *name)
{
    char tail[64];
    (void)snprintf(tail, sizeof tail, "-%s.dat", name);
    FILE *f = open_part(p, tail, &p->data_file);
    p->data_open = p->error.status == BF_OK;
    return f;
}

void picture_data_end(struct picture *p)
{
    if (p->data_open)
        (void)atomic_commit(&p->data_file, &p->error);
    p->data_open = false;
}

void plot_quote(FILE *script, const char *text)
{
    (void)fputc('\'', script);
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c == '\'')
            (void)fputs("''", script);
        else
            (void)fputc(c < 0x20 || c == 0x7f ? ' ' : c, script);
    }
    (void)fputc('\'', script);
}

void plot_panel_title(FILE *script, const char *title)
{
    (void)fputs("set label 1 ", script);
    plot_quote(script, title);
    (void)fputs(" at graph 0, graph 1 offset 0,1.75 left noenhanced\nset key at graph 1, graph 1 right bottom "
                "horizontal maxrows 1 "
                "width -1 samplen 2 height 0.2\n",
                script);
}

void plot_note(FILE *script, const char *note)
{
    if (note == NULL)
        return;
    (void)fputs("set label 9 ", script);
    plot_quote(script, note);
    (void)fputs(" at screen 0.992, screen 0.012 right noenhanced font ',' . (kind eq 'pdf' ? '6.5' : '15') textcolor "
                "rgb '" PLOT_GREY "'\n",
                script);
}

void plot_ticks(FILE *script, char axis, double low, double high)
{
    (void)fprintf(script, "set %ctics %.6g\n", axis, plot_tick_step(high > low ? high - low : 1.0));
}

void plot_axes(FILE *script, const char *x_label, const char *y_label)
{
    (void)fputs("set xlabel ", script);
    plot_quote(script, x_label);
    (void)fputs(" noenhanced offset 0,0.4\nset ylabel ", script);
    plot_quote(script, y_label);
    (void)fputs(" noenhanced\n", script);
}

void plot_sheet(FILE *script, const char *layout, const char *title)
{
    (void)fprintf(script, "set multiplot %s", layout);
    if (title != NULL) {
        (void)fputs(" title ", script);
        plot_quote(script, title);
        (void)fputs(" noenhanced", script);
    }
    (void)fputc('\n', script);
}

double plot_tick_step(double range)
{
    const double power = pow(10.0, floor(log10(range / 4.0))), x = range / 4.0 / power;
    return power * (x < 1.5 ? 1.0 : x < 3.5 ? 2.0 : x < 7.5 ? 5.0 : 10.0);
}

static void write_row(FILE *f, double t, const double *const y[], size_t n_series, size_t i)
{
    (void)fprintf(f, "%.9g", t);
    for (size_t s = 0; s < n_series; s++)
        (void)fprintf(f, " %.7g", y[s][i]);
    (void)fputc('\n', f);
}

void plot_write_series(FILE *f, double t0_s, double dt_s, const double *const y[], size_t n_series, size_t from,
                       size_t to)
{
    const size_t bucket = to - from <= SERIES_POINTS ? 1 : 2 * ((to - from) / SERIES_POINTS + 1);
    for (size_t start = from; start < to; start += bucket) {
        const size_t end = start + bucket < to ? start + bucket : to;
        if (bucket == 1) {
            write_row(f, t0_s + (double)start * dt_s, y, n_series, start);
            continue;
        }
        for (int high = 0; high < 2; high++) { /* the lowest of every series, then the highest */
            (void)fprintf(f, "%.9g", t0_s + ((double)start + 0.5 * high * (double)bucket) * dt_s);
            for (size_t s = 0; s < n_series; s++) {
                double x = y[s][start];
                for (size_t i = start; i < end; i++)
                    x = high ? fmax(x, y[s][i]) : fmin(x, y[s][i]);
                (void)fprintf(f, " %.7g", x);
            }
            (void)fputc('\n', f);
        }
    }
}

/* ---- Running ---- */

static bool gnuplot_is_there(void)
{
    const char *path = getenv("PATH");
    char *all = bf_strdup(path != NULL ? path : ""), *rest = NULL, name[1024];
    bool found = false;
    for (char *part = strtok_r(all, ":", &rest); part != NULL && !found; part = strtok_r(NULL, ":", &rest)) {
        (void)snprintf(name, sizeof name, "%s/gnuplot", part);
        found = access(name, X_OK) == 0;
    }
    free(all);
    return found;
}

bool plot_can_draw(const char *directory)
{
    const bool can = gnuplot_is_there();
    if (!can && directory != NULL)
        bf_warn("gnuplot is not installed, so there will be no pictures; their data and scripts go to %s: apt-get "
                "install gnuplot-nox, then `cd %s && for s in *.gp; do gnuplot $s; done`",
                directory, directory);
    return can;
}

static void child(const struct picture *p, const char *script, int said)
{
    const int nothing = open("/dev/null", O_RDWR);
    (void)setpgid(0, 0); /* Ctrl-C is for this program: gnuplot finishes the picture that it has begun */
    if (chdir(p->directory) == 0 && nothing >= 0 && dup2(nothing, 0) == 0 && dup2(nothing, 1) == 1 &&
        dup2(said, 2) == 2)
        (void)execlp("gnuplot", "gnuplot", script, (char *)NULL);
    _exit(errno == ENOENT ? 127 : 126);
}

/* Reads what the child says until it ends; keeps the first of it. */
static void listen_to(int from, char *text, size_t size)
{
    size_t n = 0;
    for (;;) {
        char part[256];
        const ssize_t got = read(from, part, sizeof part);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            break;
        const size_t room = size - 1 - n, take = (size_t)got < room ? (size_t)got : room;
        memcpy(text + n, part, take);
        n += take;
    }
    text[n] = '\0';
}

static enum bf_status run_gnuplot(struct picture *p, struct bf_error *err)
{
    char script[140], said[600];
    int ends[2], result = 0;
    (void)snprintf(script, sizeof script, "%s.gp", p->stem);
    if (pipe(ends) != 0)
        return bf_fail(err, BF_NUMERIC, "gnuplot cannot be started: %s", strerror(errno));
    (void)fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0) {
        (void)close(ends[0]);
        child(p, script, ends[1]);
    }
    (void)close(ends[1]);
    if (pid > 0)
        listen_to(ends[0], said, sizeof said);
    (void)close(ends[0]);
    if (pid < 0)
        return bf_fail(err, BF_NUMERIC, "gnuplot cannot be started: %s", strerror(errno));
    while (waitpid(pid, &result, 0) < 0 && errno == EINTR)
        continue;
    if (!WIFEXITED(result) || WEXITSTATUS(result) != 0)
        return bf_fail(err, BF_BAD_FILE, "%s/%s: gnuplot failed: %.400s", p->directory, script, said);
    if (said[0] != '\0')
        bf_warn("%s/%s: gnuplot says: %.400s", p->directory, script, said);
    return BF_OK;
}

/* A picture that gnuplot could not write whole (disk full) is shorter than any real one. */
static enum bf_status check_picture(const struct picture *p, const char *tail, struct bf_error *err)
{
    char *path = join(p, tail);
    struct stat info;
    enum bf_status status = BF_OK;
    if (stat(path, &info) != 0 || info.st_size < 500)
        status = bf_fail(err, BF_BAD_FILE, "%s: gnuplot did not write it; is the disk full?", path);
    free(path);
    return status;
}

static void remove_pictures(const struct picture *p)
{
    for (int i = 0; i < 2; i++) {
        char *path = join(p, picture_tails[i]);
        (void)unlink(path);
        free(path);
    }
}

enum bf_status picture_end(struct picture *p, struct bf_error *err)
{
    (void)fputs("unset output\n}\n", p->script);
    if (p->data_open)
        picture_data_end(p);
    if (p->error.status == BF_OK)
        (void)atomic_commit(&p->script_file, &p->error);
    else
        atomic_abort(&p->script_file);
    const bool ready = p->error.status == BF_OK;
    if (ready) /* an old picture must not pass for a new one */
        remove_pictures(p);
    const bool drawn = ready && gnuplot_is_there();
    if (drawn)
        (void)run_gnuplot(p, &p->error);
    if (drawn && p->error.status == BF_OK && check_picture(p, ".png", &p->error) == BF_OK)
        (void)check_picture(p, ".pdf", &p->error);
    if (ready && p->error.status != BF_OK)
        remove_pictures(p);
    free(p->directory);
    p->directory = NULL;
    return p->error.status == BF_OK ? BF_OK : bf_fail(err, p->error.status, "%s", p->error.text);
}
